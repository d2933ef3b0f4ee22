"""Pivot calibration and traced paths of a simulated pointer, against the truth."""

from __future__ import annotations

import numpy as np
import pytest
from registration_cases import some_pose
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.registration import SimulatedTracker, calibrate_pivot, traced_path
from vfix_engine.registration.tracker import TIP_MM

PLACE = np.array([20.0, -40.0, 900.0])


def test_without_noise_the_tip_is_exact() -> None:
    found = calibrate_pivot(SimulatedTracker(1, sigma_mm=0.0).pivot(PLACE, 10))
    assert found.tip_mm == pytest.approx(TIP_MM, abs=1e-8)
    assert found.pivot_mm == pytest.approx(PLACE, abs=1e-8)
    assert found.residual_mm < 1e-9


def test_it_is_the_least_squares_solution() -> None:
    """Against a general solver of the same sum, started elsewhere."""
    poses = SimulatedTracker(2).pivot(PLACE, 30)

    def residuals(x: np.ndarray) -> np.ndarray:
        return (poses[:, :3, :3] @ x[:3] + poses[:, :3, 3] - x[3:]).ravel()

    best = least_squares(residuals, np.ones(6), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    found = calibrate_pivot(poses)
    assert np.concatenate([found.tip_mm, found.pivot_mm]) == pytest.approx(best.x, abs=1e-5)
    assert found.residual_mm == pytest.approx(np.sqrt(2.0 * best.cost / 30))
    assert found.residuals_mm.shape == (30,)


def test_its_error_is_as_told() -> None:
    """rms over 150 calibrations within 20 % of what each tells of itself."""
    errors, told = [], []
    for seed in range(150):
        found = calibrate_pivot(SimulatedTracker(seed).pivot(PLACE, 40))
        errors.append(np.linalg.norm(found.tip_mm - TIP_MM))
        told.append(found.tip_error_mm)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.sqrt(np.mean(np.square(told))), rel=0.2)


@pytest.mark.parametrize("swung", ["not", "little", "one axis"])
def test_too_little_rotation_is_refused(swung: str) -> None:
    tracker = SimulatedTracker(3)
    if swung == "one axis":
        poses = []
        for angle in np.radians(np.linspace(-60.0, 60.0, 20)):
            pose = np.eye(4)
            pose[:3, :3] = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
            pose[:3, 3] = PLACE - pose[:3, :3] @ TIP_MM
            poses.append(tracker.measured(pose))
        given = np.array(poses)
    else:
        given = np.array([np.eye(4)] * 20) if swung == "not" else tracker.pivot(PLACE, 20, tilt_deg=2.0)
    with pytest.raises(InputError, match="swing it by 30 degrees"):
        calibrate_pivot(given)


def test_wrong_poses_are_refused() -> None:
    poses = SimulatedTracker(4).pivot(PLACE, 10)
    scaled = poses.copy()
    scaled[3, :3, :3] *= 1.1
    for wrong, words in ((poses[:5], "too few"), (poses[0], "n, 4, 4"), (scaled, "number 4 .*not rigid")):
        with pytest.raises(InputError, match=words):
            calibrate_pivot(wrong)


CONTROL = np.array([(0, 0, 0), (6, 20, 4), (2, 42, 14), (-10, 60, 12), (-6, 80, -4), (4, 96, -8)], dtype=float)


def traced(seed: int, sigma: float = 0.15, back: bool = True) -> np.ndarray:
    """A hand along a wire, 0.2 mm a sample: rests at both ends and in the middle, and goes back a way."""
    wire, random = SplinePath(CONTROL), np.random.default_rng(seed)
    middle = 0.5 * wire.length
    along = [np.zeros(80), np.arange(0.0, middle, 0.2), np.full(120, middle)]
    if back:
        along += [np.arange(middle, middle - 12.0, -0.2), np.arange(middle - 12.0, middle, 0.2)]
    along += [np.arange(middle, wire.length, 0.2), np.full(80, wire.length)]
    at = wire.position(np.concatenate(along))
    return at + random.normal(0.0, sigma, at.shape)


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_traced_wire_is_found(seed: int, back: bool) -> None:
    """Half the samples' noise per axis (rms) from the wire, and back; no rests and no way back in it."""
    samples, wire = traced(seed, back=back), SplinePath(CONTROL)
    found = traced_path(samples)
    assert (found.degree, found.samples) == (5, len(samples))
    assert found.used < 0.6 * len(samples)
    assert found.length_mm == pytest.approx(wire.length, abs=1.0)
    assert found.path.length == pytest.approx(found.length_mm)
    spacing = np.linalg.norm(np.diff(found.points, axis=0), axis=1)
    assert (spacing > 4.0).all()
    assert (spacing < 6.1).all()
    there = [np.linalg.norm(wire.closest(p)[1] - p) for p in found.path.position(np.linspace(0, found.length_mm, 300))]
    back_again = [np.linalg.norm(found.path.closest(p)[1] - p) for p in wire.position(np.linspace(0, wire.length, 300))]
    assert np.sqrt(np.mean(np.square(there))) < 0.1
    assert max(there + back_again) < 0.5
    # Two of three components of the noise are across the path, three where the tip rests at an end.
    assert found.residual_mm == pytest.approx(0.15 * np.sqrt(2.0), rel=0.15)
    assert found.largest_mm < 1.0
    assert np.linalg.norm(found.points[0] - wire.position(0.0)) < 0.5


def test_degree_and_spacing_are_given() -> None:
    samples = traced(1)
    straight = traced_path(samples, degree=1, spacing_mm=20.0)
    assert straight.degree == 1
    assert straight.residual_mm > traced_path(samples, degree=3, spacing_mm=4.0).residual_mm
    few = traced_path(CONTROL[:3], spacing_mm=5.0)
    assert few.degree >= 1
    assert few.points[[0, -1]] == pytest.approx(CONTROL[[0, 2]], abs=1e-6)


def test_what_is_no_path_is_refused() -> None:
    still = np.zeros((200, 3)) + np.random.default_rng(1).normal(0.0, 0.1, (200, 3))
    for wrong, options, words in (
        (still, {}, "moved by less than"),
        (np.vstack([CONTROL, CONTROL[::-1]]), {}, "ended where it began"),
        (CONTROL[:1], {}, "too few"),
        (np.where(CONTROL == 42.0, np.nan, CONTROL), {}, "not finite"),
        (CONTROL, {"degree": 6}, "degree"),
        (CONTROL, {"spacing_mm": 0.0}, "spacing_mm"),
        (CONTROL, {"rest_mm": -1.0}, "rest_mm"),
    ):
        with pytest.raises(InputError, match=words):
            traced_path(wrong, **options)  # type: ignore[arg-type]


def test_a_tracker_measures_with_its_noise_and_repeats_itself() -> None:
    pose = some_pose(5)
    one, same = SimulatedTracker(7), SimulatedTracker(7)
    assert (one.measured(pose) == same.measured(pose)).all()
    off = np.array([one.measured(pose)[:3, 3] - pose[:3, 3] for _ in range(400)])
    known = [0.1, 0.1, 0.15]
    at_middle = SimulatedTracker(8, body_mm=np.array([(40, 0, 0), (-40, 0, 0), (0, 40, 0), (0, -40, 0)]))
    middle = np.array([at_middle.measured(pose)[:3, 3] - pose[:3, 3] for _ in range(600)])
    assert middle.std(axis=0) == pytest.approx(np.array(known) / 2.0, rel=0.12)  # of four points
    assert (off.std(axis=0) > middle.std(axis=0)).all()  # the body's origin is at its end
    for wrong in ({"sigma_mm": -0.1}, {"sigma_mm": (0.1, 0.1)}, {"body_mm": np.eye(3)[:2]}, {"tip_mm": (0, 0)}):
        with pytest.raises(InputError):
            SimulatedTracker(1, **wrong)
    with pytest.raises(InputError):
        one.measured(np.eye(3))
    with pytest.raises(InputError):
        one.touch(PLACE, tilt_deg=120.0)
