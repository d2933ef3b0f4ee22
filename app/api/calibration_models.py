"""Models of calibrations in the API."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

from app.api.dependencies import Number, Wish
from app.api.plan_models import Name, Revision
from app.registration.calibration import (
    LONGEST_PIVOT_S,
    PIVOT_S,
    SHORTEST_PIVOT_S,
)
from app.registration.calibration_records import (
    PointerTip,
    PosesFrom,
    RobotToTracker,
    pointer_cautions,
    robot_cautions,
)
from app.registration.simulated_touch import DEFAULT_NOISE_MM

Triple = tuple[float, float, float]


class PointerTipPublic(BaseModel):
    """The tip of a tracked pointer, mm in the frame whose pose the tracker tells, and how it was found.

    residual_mm: rms distance of the tip from where it stood; tip_error_mm: expected rms error of it; swing_deg: half
    angle of the cone that the pointer was swung in. cautions: sentences.
    """

    tip: Triple
    residual_mm: float
    tip_error_mm: float
    swing_deg: float
    poses: int
    measured_from: PosesFrom
    cautions: list[str]

    @classmethod
    def of(cls, pointer: PointerTip | None) -> PointerTipPublic | None:
        return None if pointer is None else cls(**vars(pointer), cautions=list(pointer_cautions(pointer)))


class RobotToTrackerPublic(BaseModel):
    """Where the tracker stands beside the robot. transform: from the tracker to the base, 16 numbers row by row, mm.

    covariance: 36 numbers, row by row, of its error (t, ω) in mm and rad. cautions: sentences.
    """

    transform: list[float]
    rotation_residual_deg: float
    translation_residual_mm: float
    covariance: list[float]
    poses: int
    measured_from: PosesFrom
    cautions: list[str]

    @classmethod
    def of(cls, robot: RobotToTracker | None) -> RobotToTrackerPublic | None:
        return None if robot is None else cls(**vars(robot), cautions=list(robot_cautions(robot)))


class SimulateWish(Wish):
    """A simulated calibration. noise_mm: rms length of the error of each tracked point; seed: null for a new one."""

    noise_mm: Number = DEFAULT_NOISE_MM
    seed: Annotated[int | None, Field(ge=0, lt=2**63, strict=True)] = None
    revision: Revision = None


class SwingWish(Wish):
    """How long the tracked pointer is swung about its tip."""

    seconds: Annotated[float, Field(ge=SHORTEST_PIVOT_S, le=LONGEST_PIVOT_S, allow_inf_nan=False, strict=True)] = (
        PIVOT_S
    )
    revision: Revision = None


class ToBaseWish(Wish):
    """A new registration to the robot's base; without a name it has that of the other one."""

    name: Name | None = None
    revision: Revision = None
