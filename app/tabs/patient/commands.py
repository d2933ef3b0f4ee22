"""Commands of the Patient tab."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import StringConstraints

from app.kit.names import COLOUR
from app.messages.fields import Command, Identifier, Name


class CaseCommand(Command):
    type: Literal["case.open", "case.delete", "case.restore"]
    case_id: Identifier


class RenameCase(Command):
    type: Literal["case.rename"]
    case_id: Identifier
    name: Name


class ShowStructures(Command):
    """Show or hide an imported structure of the open case, or all of them."""

    type: Literal["structure.show"]
    structure_id: Identifier | None = None
    shown: bool


class ChangeStructure(Command):
    type: Literal["structure.change"]
    structure_id: Identifier
    name: Name | None = None
    colour: Annotated[str, StringConstraints(pattern=f"^{COLOUR}$")] | None = None


class DeleteStructure(Command):
    type: Literal["structure.delete"]
    structure_id: Identifier


STRUCTURE_COMMANDS = (ShowStructures, ChangeStructure, DeleteStructure)
COMMANDS: tuple[type[Command], ...] = (CaseCommand, RenameCase, *STRUCTURE_COMMANDS)
