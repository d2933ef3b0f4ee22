"""What a registration was measured with: a tracked pointer, and the tracker that stands beside the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, get_args

import numpy as np

from app.kit.values import MAX_COORDINATE, Position, check_position, number
from vfix_engine.errors import InputError
from vfix_engine.registration.chained_error import checked_covariance
from vfix_engine.validate import rigid_transform

PosesFrom = Literal["file", "simulated", "tracker"]
MAX_POSES = 10_000
FEW_POSES = 12  # of a robot; its error is told roughly by fewer

_SLIPPED_MM = 1.0  # residual beyond which the tip did not stay in its place
_LITTLE_SWING_DEG = 20.0
_UNLIKE_MM, _UNLIKE_DEG = 1.0, 0.5  # residuals of a robot and a tracker that do not tell of the same motion


@dataclass(frozen=True)
class PointerTip:
    """The tip of a tracked pointer, found by pivot calibration; mm and degrees.

    tip: in the frame whose pose the tracker tells, (0, 0, 0) of a tracker that tells the pose of the tip itself.
    residual_mm, tip_error_mm, swing_deg: see `vfix_engine.registration.PivotCalibration`. poses: how many were used.
    """

    tip: Position
    residual_mm: float
    tip_error_mm: float
    swing_deg: float
    poses: int
    measured_from: PosesFrom


@dataclass(frozen=True)
class RobotToTracker:
    """Where the tracker stands beside the robot, found from paired poses; mm and degrees.

    transform: 16 numbers, row by row, from the tracker's frame to the robot's base. covariance: 36 numbers, row by row,
    of its error, see `vfix_engine.registration.HandEye`. poses: how many pairs of poses were used.
    """

    transform: tuple[float, ...]
    rotation_residual_deg: float
    translation_residual_mm: float
    covariance: tuple[float, ...]
    poses: int
    measured_from: PosesFrom


def tool_to_json(tool: PointerTip | RobotToTracker | None) -> dict[str, Any] | None:
    """Plain JSON values, each number unrounded."""
    if tool is None:
        return None
    return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(tool).items()}


def pointer_from_json(item: Any) -> PointerTip | None:
    """The inverse of `tool_to_json`, checked. Raises InputError."""
    if item is None:
        return None
    values = _fields(PointerTip, item, "the pointer's tip", "tip")
    return check_pointer(PointerTip(**{**values, "tip": check_position(values["tip"])}))


def robot_from_json(item: Any) -> RobotToTracker | None:
    """The inverse of `tool_to_json`, checked. Raises InputError."""
    if item is None:
        return None
    values = _fields(RobotToTracker, item, "the robot's calibration", "transform", "covariance")
    rows = {name: tuple(number(x, f"the {name}") for x in values[name]) for name in ("transform", "covariance")}
    return check_robot(RobotToTracker(**{**values, **rows}))


def check_pointer(pointer: PointerTip | None) -> PointerTip | None:
    """The pointer's tip, where its figures can be. Raises InputError."""
    if pointer is None:
        return None
    check_position(pointer.tip)
    for name in ("residual_mm", "tip_error_mm", "swing_deg"):
        _at_least_0(getattr(pointer, name), f"the pointer's {name}")
    _check_source(pointer.poses, pointer.measured_from)
    return pointer


def check_robot(robot: RobotToTracker | None) -> RobotToTracker | None:
    """The robot's calibration, where its figures can be. Raises InputError."""
    if robot is None:
        return None
    if len(robot.transform) != 16 or len(robot.covariance) != 36:
        raise InputError("the robot's calibration has a transform of 16 numbers and a covariance of 36.")
    check_rigid(robot.transform, "the transform from the tracker to the robot")
    checked_covariance(np.array(robot.covariance).reshape(6, 6))
    for name in ("rotation_residual_deg", "translation_residual_mm"):
        _at_least_0(getattr(robot, name), f"the robot's {name}")
    _check_source(robot.poses, robot.measured_from)
    return robot


def check_rigid(transform: Sequence[float], what: str) -> None:
    """Refuse 16 numbers, row by row, that are no rigid transform within reach of a patient (HAZ-05), mm.

    Raises InputError; the message begins with `what`.
    """
    matrix = np.array(transform).reshape(4, 4)
    if np.isfinite(matrix).all() and (moved := np.abs(matrix[:3, 3]).max()) >= MAX_COORDINATE:
        raise InputError(f"{what} moves by {moved:.4g} mm, beyond {MAX_COORDINATE:g} mm; check its unit, mm.")
    rigid_transform(matrix, what)


def _fields(kind: type[Any], item: Any, what: str, *lists: str) -> dict[str, Any]:
    known = {field.name for field in fields(kind)}
    if not isinstance(item, Mapping) or set(item) != known:
        raise InputError(f"{what} has {', '.join(sorted(known))}.")
    for name in lists:
        if not isinstance(item[name], list):
            raise InputError(f"{what} has a list of numbers as its {name}.")
    return dict(item)


def _at_least_0(value: Any, what: str) -> None:
    if number(value, what) < 0.0:
        raise InputError(f"{what} is from 0 on.")


def _check_source(poses: Any, measured_from: Any) -> None:
    if isinstance(poses, bool) or not isinstance(poses, int) or not 0 < poses <= MAX_POSES:
        raise InputError(f"how many poses were used is a count from 1 to {MAX_POSES:,}.")
    if measured_from not in get_args(PosesFrom):
        raise InputError(f"poses come from {', '.join(get_args(PosesFrom))}, not {measured_from!r:.20}.")


def pointer_cautions(pointer: PointerTip) -> tuple[str, ...]:
    """What is doubtful of a pointer's calibration, in sentences."""
    found = []
    if pointer.residual_mm > _SLIPPED_MM:
        found.append(
            f"The tip was {pointer.residual_mm:.1f} mm off its place, rms: it slipped, or the pointer bends. "
            "Calibrate it again with the tip held in a dimple."
        )
    if pointer.swing_deg < _LITTLE_SWING_DEG:
        found.append(f"The pointer was swung by {pointer.swing_deg:.0f}° only; 30° to all sides tell its tip better.")
    return tuple(found)


def robot_cautions(robot: RobotToTracker) -> tuple[str, ...]:
    """What is doubtful of a robot's calibration, in sentences."""
    found = []
    if robot.translation_residual_mm > _UNLIKE_MM or robot.rotation_residual_deg > _UNLIKE_DEG:
        found.append(
            "The poses of the robot and of the tracker do not tell of the same motion: rows of both tables belong to "
            "different moments, the marker is loose, or the robot moved while it was measured."
        )
    if robot.poses < FEW_POSES:
        found.append(f"{robot.poses} poses tell their own error roughly; take {FEW_POSES} or more.")
    return tuple(found)
