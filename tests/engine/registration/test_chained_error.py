"""The error at a target of the robot's base: that of the points, and that of the tracker beside the robot."""

from __future__ import annotations

import numpy as np
import pytest
from registration_cases import BEADS, TARGETS, placed, some_pose
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.registration import HandEye, Registration, register_points, register_robot_to_tracker, target_errors_mm
from vfix_engine.registration.chained_error import target_covariances
from vfix_engine.registration.expected_error import ball_radius, estimated_factor
from vfix_engine.registration.rigid_fit import rigid_fits
from vfix_engine.registration.tracker import BODY_MM

MARKER_TO_FLANGE, TRACKER_TO_BASE = some_pose(31, 60.0), some_pose(32, 800.0)
CENTRE = np.array([500.0, 0.0, 300.0])  # of where the flange is moved and the head lies, in the base's frame
SIGMA_MM = 0.1  # of a point of a body, per axis
TRIALS = 1000
BEAD_SIGMA_MM = 0.1  # of a bead that is touched, per axis


def calibrated(random: np.random.Generator, count: int) -> HandEye:
    """A robot's calibration from poses with noise, as `SimulatedTracker` measures them, all at once."""
    turns = random.normal(size=(count, 3))
    turns *= (np.radians(40.0) * random.uniform(0.2, 1.0, count) / np.linalg.norm(turns, axis=1))[:, None]
    robot, tracked = np.tile(np.eye(4), (2, count, 1, 1))
    robot[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    robot[:, :3, 3] = CENTRE + random.uniform(-150.0, 150.0, (count, 3))
    true = np.linalg.inv(TRACKER_TO_BASE) @ robot @ MARKER_TO_FLANGE
    seen = np.einsum("nij,pj->npi", true[:, :3, :3], BODY_MM) + true[:, None, :3, 3]
    seen += random.normal(0.0, SIGMA_MM, seen.shape)
    tracked[:, :3, :3], tracked[:, :3, 3] = rigid_fits(seen, BODY_MM[None], np.ones(len(BODY_MM)))
    return register_robot_to_tracker(robot, tracked)


Chains = tuple[np.ndarray, list[tuple[Registration, HandEye]]]


def chains(trials: int, poses: int) -> Chains:
    """Lengths (trials, targets) of the error of whole chains, and what was fitted in each."""
    random = np.random.default_rng(poses)
    image_to_tracker = np.linalg.inv(TRACKER_TO_BASE) @ some_pose(6, 100.0)
    image_to_tracker[:3, 3] = placed(np.linalg.inv(TRACKER_TO_BASE), CENTRE[None])[0]
    truth = placed(TRACKER_TO_BASE @ image_to_tracker, TARGETS)
    errors, fits = [], []
    for _ in range(trials):
        robot = calibrated(random, poses)
        touched = placed(image_to_tracker, BEADS) + random.normal(0.0, BEAD_SIGMA_MM, BEADS.shape)
        registration = register_points(placed(robot.transform_tracker_to_base, touched), BEADS)
        errors.append(np.linalg.norm(registration.to_fixed(TARGETS) - truth, axis=1))
        fits.append((registration, robot))
    return np.array(errors), fits


def expected(done: Chains, fle_mm: float | None) -> tuple[np.ndarray, np.ndarray]:
    """The expected rms errors (trials, targets), and the radii of 95 % (trials,) at the first target."""
    parts = [target_covariances(fit, TARGETS, fle_mm, motion_covariance=robot.covariance) for fit, robot in done[1]]
    of_fit, between = np.array(parts).transpose(1, 0, 2, 3, 4)
    factor = estimated_factor(len(BEADS)) if fle_mm is None else 1.0
    radii = ball_radius(factor**2 * of_fit[:, 0] + between[:, 0])
    return np.sqrt(np.trace(of_fit + between, axis1=2, axis2=3)), radii


@pytest.fixture(scope="module")
def many() -> Chains:
    return chains(TRIALS, 20)


@pytest.mark.parametrize("fle_mm", [np.sqrt(3.0) * BEAD_SIGMA_MM, None])
def test_the_whole_chain_is_as_far_off_as_expected(many: Chains, fle_mm: float | None) -> None:
    """Of many calibrations with 20 poses, and as many fits of five beads: rms within 4 %, 95 of 100 in the ball."""
    rms, radii = expected(many, fle_mm)
    measured = np.sqrt(np.mean(many[0] ** 2, axis=0))
    assert measured == pytest.approx(np.sqrt(np.mean(rms**2, axis=0)), rel=0.04)
    assert np.mean(many[0][:, 0] < radii) == pytest.approx(0.95, abs=0.025)
    one = many[1][0]
    _, told = target_errors_mm(one[0], TARGETS[:1], fle_mm, motion_covariance=one[1].covariance)
    assert told == pytest.approx(radii[:1])


def test_without_the_calibration_it_would_be_too_small(many: Chains) -> None:
    """The error of the points alone is less than nine tenths of what is measured."""
    alone = np.array([fit.tre_mm(TARGETS, np.sqrt(3.0) * BEAD_SIGMA_MM) for fit, _ in many[1]])
    assert (np.sqrt(np.mean(alone**2, axis=0)) < 0.9 * np.sqrt(np.mean(many[0] ** 2, axis=0))).all()


def test_few_poses_tell_their_error_too() -> None:
    """With six poses the rms error is the expected one within 10 %."""
    few = chains(TRIALS // 3, 6)
    rms, _ = expected(few, np.sqrt(3.0) * BEAD_SIGMA_MM)
    assert np.sqrt(np.mean(few[0] ** 2, axis=0)) == pytest.approx(np.sqrt(np.mean(rms**2, axis=0)), rel=0.1)


def test_its_parts_are_those_that_are_told_alone() -> None:
    registration = register_points(placed(some_pose(3, 100.0), BEADS), BEADS)
    rms, radii = target_errors_mm(registration, TARGETS, 0.5)
    assert rms == pytest.approx(registration.tre_mm(TARGETS, 0.5))
    assert radii == pytest.approx(registration.tre_95_mm(TARGETS, 0.5))
    robot = calibrated(np.random.default_rng(1), 20)
    rms, radii = target_errors_mm(registration, TARGETS, 0.0, motion_covariance=robot.covariance)
    there = placed(np.linalg.inv(robot.transform_tracker_to_base), registration.to_fixed(TARGETS))
    assert rms == pytest.approx(robot.error_mm(there))
    assert (radii > rms).all()


@pytest.mark.parametrize("wrong", [np.eye(3), -np.eye(6), np.triu(np.ones((6, 6))), np.full((6, 6), np.nan)])
def test_what_is_no_covariance_is_refused(wrong: np.ndarray) -> None:
    registration = register_points(placed(some_pose(3, 100.0), BEADS), BEADS)
    with pytest.raises(InputError, match="covariance"):
        target_errors_mm(registration, TARGETS, 0.5, motion_covariance=wrong)
