"""Commands of the Rehearse tab."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from app.drives import commands as drive
from app.drives.commands import DriveCommand, HoldCommand, Push, SetDriveSettings
from app.messages.fields import ClientMessage, Identifier
from vfix_engine.runtime.control_mode import ControlMode, Device
from vfix_engine.virtual_fixtures.path_tube import NARROWEST_MM, WIDEST_MM

__all__ = [
    "COMMANDS", "ChooseControl", "DriveCommand", "HoldCommand", "Push", "SetApproach", "SetDriveSettings", "SetErrors",
    "SetMode", "SetOptions",
]  # fmt: skip

PathMm = Annotated[float, Field(ge=0, le=1e4, allow_inf_nan=False)]  # arc length along a path [mm]


class SetMode(ClientMessage):
    type: Literal["rehearsal.mode"]
    mode: Literal["path", "free", "inspect"]
    target_id: Identifier | None = None


class SetApproach(ClientMessage):
    """Follow the path from a chosen place on, to which the tip goes straight first (Li 2004, V).

    point, at_mm: one of both, a path point of the driven plan or an arc length.
    """

    type: Literal["rehearsal.approach"]
    point: Identifier | None = None
    at_mm: PathMm | None = None

    @model_validator(mode="after")
    def _one_place(self) -> SetApproach:
        if (self.point is None) == (self.at_mm is None):
            raise ValueError("an approach has either a path point or mm")
        return self


class SetOptions(ClientMessage):
    """Options of the next start or reset.

    centre_point, centre_mm: where the remote centre is, at a path point or at an arc length; neither: where the path
    enters the head. tube_mm: radius of the tube about the path that the tip stays in; None: none.
    """

    type: Literal["rehearsal.options"]
    soft_tissue: bool
    remote_centre: bool
    speed_limit: bool
    centre_point: Identifier | None = None
    centre_mm: PathMm | None = None
    tube_mm: Annotated[float, Field(ge=NARROWEST_MM, le=WIDEST_MM, allow_inf_nan=False)] | None = None


class ChooseControl(ClientMessage):
    """Another control mode: at once among hands-on and teleoperated; to or from freehand the drive ends, and the next
    one stands at the entry. device: of a teleoperated drive. preset: a paper's parameters, from the next entry on.
    """

    type: Literal["rehearsal.control"]
    mode: ControlMode
    device: Device = "position"
    preset: Literal["li2004", "li2007"] | None = None


class SetErrors(ClientMessage):
    """What really happens, as this client sees the drive; None of a stage: off. The drive does not change.

    registration: size in mm of a registration's error, without effect where it is known. encoders: backlash in mm;
    servo: lag in ms; compliance: mm/N under the hand; head: amplitude of its motion in mm. followed: by a reference.
    """

    type: Literal["rehearsal.errors"]
    registration: Annotated[float, Field(ge=0, le=3, allow_inf_nan=False)] | None = None
    encoders: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] | None = None
    servo: Annotated[float, Field(ge=0, le=200, allow_inf_nan=False)] | None = None
    compliance: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] | None = None
    head: Annotated[float, Field(ge=0, le=5, allow_inf_nan=False)] | None = None
    followed: bool = False


COMMANDS: tuple[type[ClientMessage], ...] = (
    *drive.COMMANDS,
    drive.MoveMaster,
    drive.DeflectRate,
    SetMode,
    SetApproach,
    ChooseControl,
    SetOptions,
    SetErrors,
)
