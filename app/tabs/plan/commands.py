"""Commands of the Plan tab."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from app.messages.fields import Command, Identifier, Name, Position, Revision
from app.tabs.plan import clearance_commands
from app.tabs.plan.region_commands import PATH_COMMANDS, REGION_COMMANDS
from app.tabs.plan.second_volume import SECOND_VOLUME_COMMANDS
from app.tabs.plan.version_commands import VERSION_COMMANDS

ShapeNumber = Annotated[float, Field(ge=-1e3, le=1e3, allow_inf_nan=False)]  # what a tool may have, its reader says


class PlanCommand(Command):
    type: Literal["plan.open", "plan.duplicate", "plan.delete", "plan.restore"]
    plan_id: Identifier


class TakeTargets(Command):
    """Add the targets of another plan of this head to the open one."""

    type: Literal["targets.take"]
    plan_id: Identifier


class RenamePlan(Command):
    type: Literal["plan.rename"]
    plan_id: Identifier
    name: Name


class NewPlan(Command):
    type: Literal["plan.new"]
    name: Name


class ItemCommand(Command):
    type: Literal["item.select", "item.delete", "item.drop", "point.insert_after"]
    item_id: Identifier


class DragItem(Command):
    type: Literal["item.drag"]
    item_id: Identifier
    position: Position

    def stream(self) -> str:
        return f"{self.type}.{self.item_id}"


class RenameItem(Command):
    type: Literal["item.rename"]
    item_id: Identifier
    label: Name


class AddMode(Command):
    type: Literal["add.mode"]
    kind: Literal["point", "target", "none"]


class EditCommand(Command):
    type: Literal["redo", "ghost.confirm", "ghost.cancel", "dry_run.again"]


class Undo(Command):
    """Take the newest edit of the open plan back; with a revision only where nothing was edited since."""

    type: Literal["undo"]
    revision: Revision | None = None


class Lock(Command):
    type: Literal["lock"]
    locked: bool


class PickOnSlice(Command):
    type: Literal["pick.slice"]
    position: Position


class ChooseRobot(Command):
    """A shipped robot by its name, or an uploaded URDF by name, hash and the link that holds the tool."""

    type: Literal["plan.robot"]
    name: Identifier
    urdf: Identifier | None = None
    tool_frame: Name | None = None


class ChooseTool(Command):
    """A tool by its name; a bend or radius that is left out is the shipped one's."""

    type: Literal["plan.tool"]
    name: Identifier
    bend_deg: ShapeNumber | None = None
    shaft_radius_mm: ShapeNumber | None = None


COMMANDS: tuple[type[Command], ...] = (
    PlanCommand,
    RenamePlan,
    NewPlan,
    ItemCommand,
    DragItem,
    RenameItem,
    AddMode,
    EditCommand,
    Undo,
    Lock,
    PickOnSlice,
    ChooseRobot,
    ChooseTool,
    TakeTargets,
    *clearance_commands.COMMANDS,
    *REGION_COMMANDS,
    *PATH_COMMANDS,
    *VERSION_COMMANDS,
    *SECOND_VOLUME_COMMANDS,
)
