"""The pointer's tip and the tracker beside the robot, found from poses, and what they are to a registration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from app.registration.calibration_records import MAX_POSES, PointerTip, PosesFrom, RobotToTracker
from app.registration.document import RegistrationContent
from app.registration.file_metadata import FileMetadata
from app.registration.fit_report import refitted
from app.registration.simulated_touch import checked_noise, simulated_tracker_to_base
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo
from vfix_engine.registration import SimulatedTracker, calibrate_pivot, register_robot_to_tracker

PIVOT_S = 15.0  # that the tracked pointer is swung
SHORTEST_PIVOT_S, LONGEST_PIVOT_S = 2.0, 30.0

NO_PIVOT_MM = 5.0  # residual from which on the poses are not those of a pivot
NO_MOTION_MM, NO_MOTION_DEG = 5.0, 3.0  # residuals from which on robot and tracker did not move together
_SIMULATED_POSES = 30
_PIVOT_MM = (0.0, 0.0, 900.0)  # where the simulated pointer stands, in the tracker's frame
_BEFORE_MM, _REACH_MM, _TURN_DEG = (60.0, -40.0, 40.0), 60.0, 40.0  # how the simulated robot moves its flange
_MARKER_MM = (20.0, -15.0, 40.0)  # of the marker on the simulated flange


# -- found from poses


def pointer_of(poses: npt.ArrayLike, measured_from: PosesFrom) -> PointerTip:
    """The tip of a pointer that was swung about it, from poses (n, 4, 4). Raises InputError where it stays open."""
    given = _thinned(np.asarray(poses, dtype=np.float64))
    found = calibrate_pivot(given)
    if found.residual_mm > NO_PIVOT_MM:
        raise InputError(
            f"the tip was {found.residual_mm:.0f} mm off its place, rms: no poses of a pointer that was swung about "
            "its tip, or their quaternions are not in the order qx, qy, qz, qw."
        )
    x, y, z = found.tip_mm.tolist()
    swing = float(found.swing_deg)
    return PointerTip((x, y, z), found.residual_mm, found.tip_error_mm, swing, len(given), measured_from)


def robot_of(robot_poses: npt.ArrayLike, tracker_poses: npt.ArrayLike, measured_from: PosesFrom) -> RobotToTracker:
    """Where the tracker stands beside the robot, from paired poses (n, 4, 4). Raises InputError where it stays open."""
    found = register_robot_to_tracker(robot_poses, tracker_poses)
    if found.translation_residual_mm > NO_MOTION_MM or found.rotation_residual_deg > NO_MOTION_DEG:
        raise InputError(
            "robot and tracker moved differently; they differ by "
            f"{found.translation_residual_mm:.1f} mm and {found.rotation_residual_deg:.1f}°, rms. Rows of the tables "
            "belong to different moments, the quaternions are not in the order qx, qy, qz, qw, or the marker is loose."
        )
    covariance = 0.5 * (found.covariance + found.covariance.T)
    return RobotToTracker(
        tuple(found.transform_tracker_to_base.ravel().tolist()),
        found.rotation_residual_deg,
        found.translation_residual_mm,
        tuple(covariance.ravel().tolist()),
        len(found.translation_residuals_mm),
        measured_from,
    )


def _thinned(poses: Array) -> Array:
    """At most MAX_POSES of them, evenly."""
    if len(poses) <= MAX_POSES:
        return poses
    kept: Array = poses[np.linspace(0, len(poses) - 1, MAX_POSES).astype(int)]
    return kept


# -- simulated


def simulated_pointer(noise_mm: float, seed: int | None = None) -> PointerTip:
    """The tip of a simulated pointer. noise_mm: rms length of the error of each point of its body.

    seed: of the errors; None for others each time. Raises InputError.
    """
    return pointer_of(_tracker(noise_mm, seed).pivot(_PIVOT_MM), "simulated")


def simulated_robot(case_id: str, noise_mm: float, seed: int | None = None) -> RobotToTracker:
    """Where the simulated tracker stands beside the simulated robot; arguments and errors as `simulated_pointer`."""
    from scipy.spatial.transform import Rotation  # imported here: slow to load

    tracker, random = _tracker(noise_mm, seed), np.random.default_rng(seed)
    turns = random.normal(size=(_SIMULATED_POSES, 3))
    turns *= (np.radians(_TURN_DEG) * random.uniform(0.3, 1.0, len(turns)) / np.linalg.norm(turns, axis=1))[:, None]
    robot = np.tile(np.eye(4), (len(turns), 1, 1))
    robot[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    robot[:, :3, 3] = _BEFORE_MM + random.uniform(-_REACH_MM, _REACH_MM, (len(turns), 3))
    marker_to_flange = np.eye(4)
    marker_to_flange[:3, 3] = _MARKER_MM
    base_to_tracker = np.linalg.inv(simulated_tracker_to_base(case_id))
    seen = [tracker.measured(base_to_tracker @ pose @ marker_to_flange) for pose in robot]
    return robot_of(robot, seen, "simulated")


def _tracker(noise_mm: float, seed: int | None) -> SimulatedTracker:
    chosen = int(np.random.default_rng().integers(2**63)) if seed is None else seed
    return SimulatedTracker(chosen, sigma_mm=checked_noise(noise_mm) / np.sqrt(3.0))


# -- what they are to a registration


def motion_covariance(content: RegistrationContent) -> Array | None:
    """Covariance (6, 6) of errors that move all measured points alike, see `target_errors_mm`; None for none.

    That of the pointer's tip where the tracker measured points by it, as if it was held in one direction; and that of
    the robot's calibration where the registration is to the base.
    """
    parts = []
    pointer, robot = content.pointer, content.robot
    if pointer is not None and any(pair.measured_from == "tracker" for pair in content.used_pairs):
        parts.append(np.diag([pointer.tip_error_mm**2 / 3.0] * 3 + [0.0] * 3))
    if robot is not None and content.to == "base":
        parts.append(np.array(robot.covariance).reshape(6, 6))
    return np.sum(parts, axis=0) if parts else None


def tracked_through(content: RegistrationContent) -> tuple[Array, Array]:
    """The tip (3,) whose places the tracker measures, and the transform (4, 4) from there to what it is registered to.

    Raises InputError for a calibration that was simulated, which says nothing of a real pointer or robot, and for a
    registration to the robot's base without the robot's calibration.
    """
    pointer, robot = content.pointer, content.robot
    if pointer is not None and pointer.measured_from == "simulated":
        raise InputError("the pointer's tip is of a simulated pointer; calibrate the tracked one, or clear the tip.")
    tip = np.zeros(3) if pointer is None else np.array(pointer.tip)
    if content.to != "base":
        return tip, np.eye(4)
    if robot is None:
        raise InputError(
            "robot and tracker are not calibrated; calibrate them first for a registration to the base, "
            "or let the robot itself touch the points and type where it was."
        )
    return tip, real_tracker_to_base(robot)


def real_tracker_to_base(robot: RobotToTracker) -> Array:
    """transform_tracker_to_base (4, 4) for what was really measured. Raises InputError for a simulated calibration."""
    if robot.measured_from == "simulated":
        raise InputError("the robot's calibration is simulated; calibrate the robot that stands there.")
    return np.array(robot.transform).reshape(4, 4)


def simulated_transform(content: RegistrationContent, case_id: str) -> Array | None:
    """What takes simulated touches to what the registration is to: as it was calibrated, where that was simulated."""
    if content.to != "base":
        return None
    if content.robot is not None and content.robot.measured_from == "simulated":
        return np.array(content.robot.transform).reshape(4, 4)
    return simulated_tracker_to_base(case_id)


def with_pointer(content: RegistrationContent, pointer: PointerTip | None) -> RegistrationContent:
    """The content with a pointer's tip, or without one. Raises InputError where points were measured by another tip."""
    touched = content.surface is not None and content.surface.measured_from == "tracker"
    if touched or any(pair.measured_from == "tracker" for pair in content.pairs):
        raise InputError(
            "points of this registration were measured with the pointer as it was; forget what was measured first."
        )
    return replace(content, pointer=pointer)


def with_robot(content: RegistrationContent, robot: RobotToTracker | None) -> RegistrationContent:
    """The content with a robot's calibration, or without one. Raises InputError where points went through another."""
    if content.to == "base" and _is_measured(content):
        raise InputError(
            "the measured points depend on the present calibration; forget what was "
            "measured first, or calibrate in a registration to the patient and make one to the base from it."
        )
    return replace(content, robot=robot)


def registered_to(content: RegistrationContent, to: RegisteredTo) -> RegistrationContent:
    """The content, registered to another frame. Raises InputError where it has measured points or a transform.

    One from a file that leaves it open goes along, while nothing else was measured.
    """
    if to == content.to:
        return content
    if why := why_it_stays(content):
        raise InputError(why)
    return replace(content, to=to)


def why_it_stays(content: RegistrationContent) -> str:
    """Why what a registration is to cannot be changed, in a sentence; '' where it can."""
    if not _is_measured(content):
        return ""
    if content.made_from == "given" and not _has_points(content):
        return _why_given_stays(content)
    return (
        "what a registration is to is chosen before anything is measured; forget what was measured, or make a new "
        "registration."
    )


def _why_given_stays(content: RegistrationContent) -> str:
    """Of a transform from a file beside which nothing was measured: its file may have left open what it is to."""
    if content.said is not None and content.said.to is not None:
        return "the file of this transform says what it is to; make another registration, or import another file."
    if content.robot is not None:
        return "the robot's calibration goes with this transform; import its file anew to say what it is to."
    return ""


def taken_to_base(content: RegistrationContent) -> RegistrationContent:
    """A registration to the robot's base: points and transform of one to the patient, taken through its calibration.

    Raises InputError where it cannot be made, see `why_not_to_base`.
    """
    if why := why_not_to_base(content):
        raise InputError(why)
    assert content.robot is not None
    matrix = np.array(content.robot.transform).reshape(4, 4)

    def moved(place: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = (matrix[:3, :3] @ place + matrix[:3, 3]).tolist()
        return x, y, z

    pairs = tuple(
        pair if pair.measured is None else replace(pair, measured=moved(pair.measured)) for pair in content.pairs
    )
    surface = content.surface
    if surface is not None:
        surface = replace(surface, points=tuple(moved(place) for place in surface.points))
    transform = content.transform
    if content.made_from != "none":
        transform = tuple((matrix @ content.registration.transform).ravel().tolist())
    # Its file spoke of the transform to the patient; that this one is simulated still counts.
    said = None if content.said is None else FileMetadata(to="base", simulated=content.said.simulated)
    return refitted(replace(content, to="base", transform=transform, pairs=pairs, surface=surface, said=said))


def why_not_to_base(content: RegistrationContent) -> str:
    """Why no registration to the robot's base can be made of this one, in a sentence; '' where one can."""
    robot = content.robot
    if content.to == "base":
        return "this registration is to the robot's base already."
    if robot is None:
        return "robot and tracker are not calibrated; calibrate them first."
    if not _is_measured(content):
        return "nothing was measured yet that could be taken to the robot's base."
    sources: set[str] = {pair.measured_from for pair in content.pairs if pair.measured is not None}
    if content.surface is not None:
        sources.add(content.surface.measured_from)
    if content.said_simulated:
        sources.add("simulated")
    simulated = robot.measured_from == "simulated"
    if simulated and sources & {"tracker", "file"}:
        return "the robot's calibration is simulated and the points are not; calibrate with real poses."
    if not simulated and "simulated" in sources:
        return "the points are simulated and the robot's calibration is not; simulate both, or neither."
    return ""


def _is_measured(content: RegistrationContent) -> bool:
    return _has_points(content) or content.made_from == "given"


def _has_points(content: RegistrationContent) -> bool:
    return content.surface is not None or any(pair.measured is not None for pair in content.pairs)
