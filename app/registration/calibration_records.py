"""What a registration was measured with: a tracked pointer, and the tracker that stands beside the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from app.kit.values import MAX_COORDINATE
from app.operations.fields import Place
from vfix_engine.errors import InputError
from vfix_engine.registration.chained_error import checked_covariance
from vfix_engine.validate import rigid_transform

PosesFrom = Literal["file", "simulated", "tracker"]
MAX_POSES = 10_000
FEW_POSES = 12  # of a robot; its error is told roughly by fewer

AtLeast0 = Annotated[float, Meta(ge=0.0)]
PoseCount = Annotated[int, Meta(ge=1, le=MAX_POSES)]
Rows = Annotated[tuple[float, ...], Meta(min_length=16, max_length=16)]  # of a 4 by 4 matrix

_SLIPPED_MM = 1.0  # residual beyond which the tip did not stay in its place
_LITTLE_SWING_DEG = 20.0
_UNLIKE_MM, _UNLIKE_DEG = 1.0, 0.5  # residuals of a robot and a tracker that do not tell of the same motion


@dataclass(frozen=True)
class PointerTip:
    """The tip of a tracked pointer, found by pivot calibration; mm and degrees.

    tip: in the frame whose pose the tracker tells, (0, 0, 0) of a tracker that tells the pose of the tip itself.
    residual_mm, tip_error_mm, swing_deg: see `vfix_engine.registration.PivotCalibration`. poses: how many were used.
    """

    tip: Place
    residual_mm: AtLeast0
    tip_error_mm: AtLeast0
    swing_deg: AtLeast0
    poses: PoseCount
    measured_from: PosesFrom


@dataclass(frozen=True)
class RobotToTracker:
    """Where the tracker stands beside the robot, found from paired poses; mm and degrees.

    transform: 16 numbers, row by row, from the tracker's frame to the robot's base. covariance: 36 numbers, row by row,
    of its error, see `vfix_engine.registration.HandEye`. poses: how many pairs of poses were used.
    """

    transform: Rows
    rotation_residual_deg: AtLeast0
    translation_residual_mm: AtLeast0
    covariance: Annotated[tuple[float, ...], Meta(min_length=36, max_length=36)]
    poses: PoseCount
    measured_from: PosesFrom


def check_robot(robot: RobotToTracker | None) -> None:
    """Raises InputError for a robot's calibration whose transform or error cannot be."""
    if robot is not None:
        check_rigid(robot.transform, "the transform from the tracker to the robot")
        checked_covariance(np.array(robot.covariance).reshape(6, 6))


def check_rigid(transform: Sequence[float], what: str) -> None:
    """Refuse 16 numbers, row by row, that are no rigid transform within reach of a patient (HAZ-05), mm.

    Raises InputError; the message begins with `what`.
    """
    matrix = np.array(transform).reshape(4, 4)
    if np.isfinite(matrix).all() and (moved := np.abs(matrix[:3, 3]).max()) >= MAX_COORDINATE:
        raise InputError(f"{what} moves by {moved:.4g} mm, beyond {MAX_COORDINATE:g} mm; check its unit, mm.")
    rigid_transform(matrix, what)


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
            "Robot and tracker moved differently. Rows of both tables belong to "
            "different moments, the marker is loose, or the robot moved while it was measured."
        )
    if robot.poses < FEW_POSES:
        found.append(f"{robot.poses} poses tell their own error roughly; take {FEW_POSES} or more.")
    return tuple(found)
