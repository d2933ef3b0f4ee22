"""Commands of the Plan tab."""

from __future__ import annotations

from typing import Literal

from app.messages.fields import Command, Identifier, Position
from app.tabs.plan import clearance_commands
from app.tabs.plan.region_commands import REGION_COMMANDS


class OpenPlan(Command):
    type: Literal["plan.open"]
    plan_id: Identifier


class ItemCommand(Command):
    type: Literal["item.select", "item.drop", "point.insert_after"]
    item_id: Identifier


class DragItem(Command):
    type: Literal["item.drag"]
    item_id: Identifier
    position: Position

    def stream(self) -> str:
        return f"{self.type}.{self.item_id}"


class AddMode(Command):
    type: Literal["add.mode"]
    kind: Literal["point", "target", "none"]


class EditCommand(Command):
    type: Literal["ghost.confirm", "ghost.cancel", "dry_run.again"]


class PickOnSlice(Command):
    type: Literal["pick.slice"]
    position: Position


class CompareVersion(Command):
    """Show what changed since a version; again, it is hidden."""

    type: Literal["version.compare"]
    version_id: Identifier


COMMANDS: tuple[type[Command], ...] = (
    OpenPlan,
    ItemCommand,
    DragItem,
    AddMode,
    EditCommand,
    PickOnSlice,
    CompareVersion,
    *clearance_commands.COMMANDS,
    *REGION_COMMANDS,
)
