"""Commands of the Rehearse tab."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.messages.fields import Command, Direction, Identifier


class DriveCommand(Command):
    type: Literal["rehearsal.start", "rehearsal.pause", "rehearsal.reset", "rehearsal.end"]


class SetMode(Command):
    type: Literal["rehearsal.mode"]
    mode: Literal["path", "free", "inspect"]
    target_id: Identifier | None = None


class SetRehearsalSettings(Command):
    type: Literal["rehearsal.settings"]
    values: Annotated[
        dict[Identifier, Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]], Field(max_length=16)
    ]


class SetOptions(Command):
    """Switches of the next start or reset.

    centre_point, centre_mm: where the remote centre is, at a path point or at an arc length; neither: where the path
    enters the head.
    """

    type: Literal["rehearsal.options"]
    soft_tissue: bool
    remote_centre: bool
    speed_limit: bool
    centre_point: Identifier | None = None
    centre_mm: Annotated[float, Field(ge=0, le=1e4, allow_inf_nan=False)] | None = None


class HandCommand(Command):
    """What a hand on the handle sends."""

    urgent: ClassVar[bool] = True
    type: Literal["heartbeat", "grip.release", "rehearsal.take", "rehearsal.let_go"]


class Push(Command):
    """A key or button for motion along the path or about the shaft."""

    urgent: ClassVar[bool] = True
    type: Literal["drive", "twist"]
    direction: Direction


COMMANDS: tuple[type[Command], ...] = (DriveCommand, SetMode, SetRehearsalSettings, SetOptions, HandCommand, Push)
