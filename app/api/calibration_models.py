"""Models of calibrations in the API."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from app.api.dependencies import Number, Wish
from app.api.plan_models import Name, Revision
from app.registration.calibration import (
    LONGEST_PIVOT_S,
    PIVOT_S,
    SHORTEST_PIVOT_S,
)
from app.registration.simulated_touch import DEFAULT_NOISE_MM


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
