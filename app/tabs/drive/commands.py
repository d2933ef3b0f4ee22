"""Commands of the Drive tab, beside those of every drive."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from app.drives import commands as drives
from app.lumen.tasks import TaskName
from app.messages.fields import ClientMessage, Direction
from vfix_engine.study.polyps.printed import HOLD_S, POLYPS
from vfix_engine.worlds.snake.settings import Arm

Bound = Annotated[float, Field(ge=0.1, le=50.0, allow_inf_nan=False)]  # [mm]
LinkValue = Annotated[float, Field(ge=0.0, le=50.0, allow_inf_nan=False)]  # [mm] or [N/mm]
MaybeBound = Bound | None
Distance = Annotated[float, Field(ge=-10_000.0, le=10_000.0, allow_inf_nan=False)]  # [mm]


class TurnCamera(ClientMessage):
    """Straighten the links that bend, or turn the camera to all sides one after the other."""

    type: Literal["camera.straighten", "camera.look_round"]


class TiltCamera(ClientMessage):
    """A key that moves the camera up, 1, or down, -1; 0: no key does."""

    urgent: ClassVar[bool] = True
    type: Literal["tilt"]
    direction: Direction


class DragCamera(ClientMessage):
    """A drag in the picture: the way in mm that the camera is to go to the right and down, summed since the press.

    The robot makes up for what is left of it as fast as it may, while held; let go of, it moves no more. It needs
    heartbeats as every hand, and to be told again after these were missing.
    """

    urgent: ClassVar[bool] = True
    type: Literal["camera.drag"]
    right_mm: Distance
    down_mm: Distance
    held: bool


class InsertTo(ClientMessage):
    """A wheel in the picture: the depth in mm along the lumen that the tip is to come to, and whether it still counts.

    The robot goes there as fast as it may. It needs heartbeats as a drag does; a key or device that inserts ends it.
    """

    urgent: ClassVar[bool] = True
    type: Literal["insert.to"]
    depth_mm: Distance
    held: bool


class ChooseArm(ClientMessage):
    """Who keeps the links in the pathway. The run ends, and the next begins at the entry."""

    type: Literal["drive.arm"]
    arm: Arm


class ChooseParameters(ClientMessage):
    """A paper's parameters; null: the default ones. The run ends, and the next begins at the entry."""

    type: Literal["drive.preset"]
    preset: Literal["kwok2013"] | None


class TurnJoint(ClientMessage):
    """The universal joint that a manual hand turns: 1 is the last one, 2 the one before."""

    type: Literal["drive.joint"]
    joint: Literal[1, 2]


class SetLinkValues(ClientMessage):
    """b_i, a_i and k_i of Kwok 2013 for the five distal links, the last one's last; null: as usual.

    The run ends, and the next begins at the entry.
    """

    type: Literal["drive.links"]
    bounds_mm: tuple[MaybeBound, MaybeBound, MaybeBound, MaybeBound, MaybeBound] | None
    thresholds_mm: tuple[LinkValue, LinkValue, LinkValue, LinkValue, LinkValue] | None
    springs_n_per_mm: tuple[LinkValue, LinkValue, LinkValue, LinkValue, LinkValue] | None


class ChooseTask(ClientMessage):
    """A task of Kwok 2013 for the next run; null: none. The run ends, and the next begins at the entry.

    places: of the polyps, drawn by the seed where the robot can view them, or those of the route. count: of drawn
    ones, six labels at most; hold_s: for how long each polyp has to be viewed. Both are the paper's if left out.
    """

    type: Literal["drive.task"]
    task: TaskName | None
    places: Literal["seed", "route"] = "seed"
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    count: Annotated[int, Field(ge=1, le=20)] = POLYPS
    hold_s: Annotated[float, Field(ge=0.1, le=60.0, allow_inf_nan=False)] = HOLD_S


class CutTool(ClientMessage):
    """The button of the tool is held, or let go of; it needs heartbeats as every hand."""

    urgent: ClassVar[bool] = True
    type: Literal["drive.cut"]
    on: bool


class ShowBends(ClientMessage):
    """Show the control bends in this window as ghosts of the robot, or hide them."""

    type: Literal["drive.bends"]
    on: bool


COMMANDS: tuple[type[ClientMessage], ...] = (
    *drives.COMMANDS,
    drives.MoveAxes,
    TurnCamera,
    TiltCamera,
    DragCamera,
    InsertTo,
    ChooseArm,
    ChooseParameters,
    TurnJoint,
    SetLinkValues,
    ChooseTask,
    CutTool,
    ShowBends,
)
