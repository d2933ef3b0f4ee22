"""The tracker beside the robot, and the whole chain from beads in an image to a target at the robot."""

from __future__ import annotations

import numpy as np
import pytest
from registration_cases import BEADS, TARGETS, placed, some_pose
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.registration import (
    SimulatedTracker,
    calibrate_pivot,
    register_points,
    register_robot_to_tracker,
)
from vfix_engine.registration.points import Registration
from vfix_engine.registration.tracker import BODY_MM, TIP_MM

MARKER_TO_FLANGE, TRACKER_TO_BASE = some_pose(31, 60.0), some_pose(32, 800.0)
CENTRE = np.array([500.0, 0.0, 300.0])  # of where the flange is moved, in the base's frame


def robot_poses(seed: int, count: int = 30, turn_deg: float = 40.0) -> np.ndarray:
    """Flange in the base: within 150 mm, turned by up to ``turn_deg`` about any axis."""
    random = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (count, 1, 1))
    axes = random.normal(size=(count, 3))
    axes *= (np.radians(turn_deg) * random.uniform(0.2, 1.0, count) / np.linalg.norm(axes, axis=1))[:, None]
    poses[:, :3, :3] = Rotation.from_rotvec(axes).as_matrix()
    poses[:, :3, 3] = CENTRE + random.uniform(-150.0, 150.0, (count, 3))
    return poses


def seen(tracker: SimulatedTracker, poses: np.ndarray) -> np.ndarray:
    """The marker on the flange as the tracker measures it."""
    return np.array([tracker.measured(np.linalg.inv(TRACKER_TO_BASE) @ pose @ MARKER_TO_FLANGE) for pose in poses])


@pytest.mark.parametrize("count", [5, 30])
def test_without_noise_it_is_exact(count: int) -> None:
    poses = robot_poses(1, count)
    found = register_robot_to_tracker(poses, seen(SimulatedTracker(1, sigma_mm=0.0), poses))
    assert found.transform_tracker_to_base == pytest.approx(TRACKER_TO_BASE, abs=1e-7)
    assert found.transform_marker_to_flange == pytest.approx(MARKER_TO_FLANGE, abs=1e-7)
    assert found.translation_residual_mm < 1e-7
    assert found.rotation_residual_deg < 1e-6


def test_it_is_the_least_squares_solution() -> None:
    """Against a general solver of both transforms; rotations count as displacements at 50 mm."""
    poses = robot_poses(2)
    tracked = seen(SimulatedTracker(2), poses)
    found = register_robot_to_tracker(poses, tracked)

    def made(x: np.ndarray) -> np.ndarray:
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec(x[:3]).as_matrix(), x[3:]
        return pose

    def residuals(x: np.ndarray) -> np.ndarray:
        ways, others = poses @ MARKER_TO_FLANGE @ made(x[:6]), made(x[6:]) @ TRACKER_TO_BASE @ tracked
        # ‖R − S‖² / 2 is the squared angle, to first order.
        turned = (ways - others)[:, :3, :3].reshape(len(poses), -1) * 50.0 / np.sqrt(2.0)
        return np.hstack([turned, (ways - others)[:, :3, 3]]).ravel()

    best = least_squares(residuals, np.zeros(12), x_scale=np.repeat([1e-3, 0.1, 1e-3, 0.1], 3), xtol=1e-15, ftol=1e-15)
    assert found.transform_marker_to_flange == pytest.approx(MARKER_TO_FLANGE @ made(best.x[:6]), abs=2e-3)
    assert found.transform_tracker_to_base == pytest.approx(made(best.x[6:]) @ TRACKER_TO_BASE, abs=2e-3)
    assert found.translation_residuals_mm.shape == found.rotation_residuals_deg.shape == (30,)
    ways, others = poses @ found.transform_marker_to_flange, found.transform_tracker_to_base @ tracked
    apart = np.linalg.norm(ways[:, :3, 3] - others[:, :3, 3], axis=1)
    assert found.translation_residuals_mm == pytest.approx(apart)
    angles = np.degrees(
        (Rotation.from_matrix(ways[:, :3, :3]).inv() * Rotation.from_matrix(others[:, :3, :3])).magnitude()
    )
    assert found.rotation_residuals_deg == pytest.approx(angles, abs=1e-6)


def test_its_error_is_as_told() -> None:
    """At places beside the robot, rms over 80 calibrations within 10 % of what each tells of itself."""
    places = placed(np.linalg.inv(TRACKER_TO_BASE), CENTRE + np.array([[0.0, 0.0, 0.0], [200.0, 0.0, -100.0]]))
    errors, told = [], []
    for seed in range(80):
        poses = robot_poses(seed)
        found = register_robot_to_tracker(poses, seen(SimulatedTracker(seed), poses))
        off = placed(found.transform_tracker_to_base, places) - placed(TRACKER_TO_BASE, places)
        errors.append(np.linalg.norm(off, axis=1))
        told.append(found.error_mm(places))
    assert np.sqrt(np.mean(np.square(errors), axis=0)) == pytest.approx(
        np.sqrt(np.mean(np.square(told), axis=0)), rel=0.1
    )


@pytest.mark.parametrize("motion", ["none", "one axis", "too small"])
def test_degenerate_motion_is_refused(motion: str) -> None:
    poses = robot_poses(4, turn_deg=1.0)
    if motion == "one axis":
        angles = np.linspace(-60.0, 60.0, len(poses))
        poses[:, :3, :3] = Rotation.from_euler("z", angles[:, None], degrees=True).as_matrix()
    elif motion == "none":
        poses[:, :3, :3] = np.eye(3)
    with pytest.raises(InputError, match="about two axes at least"):
        register_robot_to_tracker(poses, seen(SimulatedTracker(4), poses))


def test_wrong_poses_are_refused() -> None:
    poses = robot_poses(5)
    tracked = seen(SimulatedTracker(5), poses)
    for a, b, words in (
        (poses[:4], tracked[:4], "too few"),
        (poses, tracked[:20], "no pairs"),
        (poses * 2, tracked, "not rigid"),
    ):
        with pytest.raises(InputError, match=words):
            register_robot_to_tracker(a, b)


def test_the_whole_chain_ends_as_far_off_as_predicted() -> None:
    """Pivot, touch five beads, register, robot to tracker: targets of the image in the robot's base, 80 times.

    The prediction adds the squares of the target error, the calibration's and that of the hand-eye transform. The
    localisation error is that of the tip, of a body whose points the tracker sees; within 15 %.
    """
    image_to_tracker = np.linalg.inv(TRACKER_TO_BASE) @ some_pose(6, 100.0)
    image_to_tracker[:3, 3] = placed(np.linalg.inv(TRACKER_TO_BASE), CENTRE[None])[0]
    truth = placed(TRACKER_TO_BASE @ image_to_tracker, TARGETS)
    sigma = 0.1
    # Of the tip, as the fit of the body predicts it.
    tip_fle = float(Registration(np.eye(4), BODY_MM, BODY_MM, np.ones(4)).tre_mm(TIP_MM, np.sqrt(3.0) * sigma)[0])
    random = np.random.default_rng(1)
    bead_sigma = 0.03  # of the centres in the image
    errors, predicted, fre = [], [], []
    for seed in range(80):
        tracker = SimulatedTracker(seed, sigma_mm=sigma)
        pivot = calibrate_pivot(tracker.pivot([0.0, 0.0, 900.0], 60))
        touched = []
        for bead in placed(image_to_tracker, BEADS):
            pose = tracker.touch(bead)
            touched.append(pose[:3, :3] @ pivot.tip_mm + pose[:3, 3])
        in_image = BEADS + random.normal(0.0, bead_sigma, BEADS.shape)
        registration = register_points(touched, in_image)
        poses = robot_poses(seed)
        hand_eye = register_robot_to_tracker(poses, seen(tracker, poses))
        at_tracker = registration.to_fixed(TARGETS)
        errors.append(np.linalg.norm(placed(hand_eye.transform_tracker_to_base, at_tracker) - truth, axis=1))
        fle = np.sqrt(tip_fle**2 + 3.0 * bead_sigma**2)
        # The pointer is held in much the same direction at all beads: the tip's calibration moves them all alike.
        common = pivot.tip_error_mm
        parts = (registration.tre_mm(TARGETS, fle), common, hand_eye.error_mm(at_tracker))
        predicted.append(np.sqrt(sum(np.square(part) for part in parts)))
        fre.append(registration.fre_mm)
    measured = np.sqrt(np.mean(np.square(errors), axis=0))
    assert measured == pytest.approx(np.sqrt(np.mean(np.square(predicted), axis=0)), rel=0.15)
    assert np.sqrt(np.mean(np.square(fre))) == pytest.approx(np.sqrt(1.0 - 2.0 / 5.0) * fle, rel=0.15)
