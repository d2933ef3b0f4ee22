"""Commands of a drive, the same for every world; a tab that drives declares those that it answers."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.drives.live_comments import MAX_CHARACTERS
from app.messages.fields import ClientMessage, Direction, Identifier, Position

Axis = Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False)]


class DriveCommand(ClientMessage):
    type: Literal["rehearsal.start", "rehearsal.pause", "rehearsal.reset", "rehearsal.end"]


class SetDriveSettings(ClientMessage):
    type: Literal["rehearsal.settings"]
    values: Annotated[
        dict[Identifier, Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]], Field(max_length=16)
    ]


class Comment(ClientMessage):
    """A comment on the drive at its present time; any client may write one."""

    type: Literal["rehearsal.comment"]
    text: Annotated[str, Field(min_length=1, max_length=MAX_CHARACTERS)]


class HoldCommand(ClientMessage):
    """Motion of a hand that holds the handle."""

    urgent: ClassVar[bool] = True
    type: Literal["heartbeat", "grip.release", "rehearsal.take", "rehearsal.let_go"]


class Push(ClientMessage):
    """A key or button for motion along the path or about the shaft."""

    urgent: ClassVar[bool] = True
    type: Literal["drive", "twist"]
    direction: Direction


class MoveAxes(ClientMessage):
    """Camera and insertion of a device, from -1 to +1 of full speed, while something is held; keys are added."""

    urgent: ClassVar[bool] = True
    type: Literal["axes"]
    camera_x: Axis = 0.0
    camera_y: Axis = 0.0
    insert: Axis = 0.0


class MoveMaster(ClientMessage):
    """The sum of a master's motions so far, in mm along the patient's axes, and whether it is coupled to the tool."""

    urgent: ClassVar[bool] = True
    type: Literal["master"]
    position: Position
    clutch: bool


class DeflectRate(ClientMessage):
    """Deflection of a device that pushes and turns, from -1 to +1 in the frame of the picture: right, down and into it,
    then right-hand turns about these. Told again while it lasts, six zeros at its end.
    """

    urgent: ClassVar[bool] = True
    type: Literal["rate"]
    axes: tuple[Axis, Axis, Axis, Axis, Axis, Axis]


COMMANDS: tuple[type[ClientMessage], ...] = (DriveCommand, SetDriveSettings, Comment, HoldCommand, Push)
