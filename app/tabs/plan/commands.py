"""Commands of the Plan tab."""

from __future__ import annotations

from typing import Literal

from app.messages.fields import ClientMessage, Identifier, Position
from app.tabs.plan import clearance_commands
from app.tabs.plan.region_commands import REGION_COMMANDS


class OpenPlan(ClientMessage):
    type: Literal["plan.open"]
    plan_id: Identifier


class ItemCommand(ClientMessage):
    type: Literal["item.select", "item.drop", "point.insert_after"]
    item_id: Identifier


class DragItem(ClientMessage):
    type: Literal["item.drag"]
    item_id: Identifier
    position: Position

    def stream(self) -> str:
        return f"{self.type}.{self.item_id}"


class AddMode(ClientMessage):
    type: Literal["add.mode"]
    kind: Literal["point", "target", "none"]


class EditCommand(ClientMessage):
    type: Literal["ghost.confirm", "ghost.cancel", "dry_run.again"]


class UseOpening(ClientMessage):
    """Enter at an opening: the first point of the path is there, and its side is that of the path, as one edit."""

    type: Literal["opening.use"]
    opening_id: Identifier


class PickOnSlice(ClientMessage):
    type: Literal["pick.slice"]
    position: Position


class CompareVersion(ClientMessage):
    """Show what changed since a version; again, it is hidden."""

    type: Literal["version.compare"]
    version_id: Identifier


COMMANDS: tuple[type[ClientMessage], ...] = (
    OpenPlan,
    ItemCommand,
    DragItem,
    AddMode,
    EditCommand,
    UseOpening,
    PickOnSlice,
    CompareVersion,
    *clearance_commands.COMMANDS,
    *REGION_COMMANDS,
)
