"""What a registration is to and was measured with, as the page shows it."""

from __future__ import annotations

from typing import TypedDict

from app.registration.calibration import why_it_stays, why_not_to_base
from app.registration.calibration_records import PosesFrom, pointer_cautions, robot_cautions
from app.registration.document import RegistrationContent
from vfix_engine.frames import RegisteredTo


class PointerTipView(TypedDict):
    """The calibrated tip of the pointer; mm and degrees."""

    residual_mm: float
    tip_error_mm: float
    swing_deg: float
    poses: int
    measured_from: PosesFrom
    cautions: list[str]


class RobotView(TypedDict):
    """The tracker beside the robot, as it was calibrated."""

    translation_residual_mm: float
    rotation_residual_deg: float
    poses: int
    measured_from: PosesFrom
    cautions: list[str]


class CalibrationView(TypedDict):
    """Of the open registration. stays: why `to` cannot be changed; no_base: why none to the base can be made; or ''."""

    to: RegisteredTo
    stays: str
    pointer: PointerTipView | None
    robot: RobotView | None
    no_base: str


def calibration_view(content: RegistrationContent) -> CalibrationView:
    """The part of the open registration's section."""
    pointer, robot = content.pointer, content.robot
    return {
        "to": content.to,
        "stays": why_it_stays(content),
        "pointer": None
        if pointer is None
        else {
            "residual_mm": pointer.residual_mm,
            "tip_error_mm": pointer.tip_error_mm,
            "swing_deg": pointer.swing_deg,
            "poses": pointer.poses,
            "measured_from": pointer.measured_from,
            "cautions": list(pointer_cautions(pointer)),
        },
        "robot": None
        if robot is None
        else {
            "translation_residual_mm": robot.translation_residual_mm,
            "rotation_residual_deg": robot.rotation_residual_deg,
            "poses": robot.poses,
            "measured_from": robot.measured_from,
            "cautions": list(robot_cautions(robot)),
        },
        "no_base": why_not_to_base(content),
    }
