"""Commands of the Patient tab."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import StringConstraints

from app.kit.names import COLOUR
from app.messages.fields import ClientMessage, Identifier, Name


class CaseCommand(ClientMessage):
    type: Literal["case.open", "case.delete", "case.restore"]
    case_id: Identifier


class RenameCase(ClientMessage):
    type: Literal["case.rename"]
    case_id: Identifier
    name: Name


class ShowStructures(ClientMessage):
    """Show or hide an imported structure of the open case, or all of them."""

    type: Literal["structure.show"]
    structure_id: Identifier | None = None
    shown: bool


class ChangeStructure(ClientMessage):
    type: Literal["structure.change"]
    structure_id: Identifier
    name: Name | None = None
    colour: Annotated[str, StringConstraints(pattern=f"^{COLOUR}$")] | None = None


class DeleteStructure(ClientMessage):
    type: Literal["structure.delete"]
    structure_id: Identifier


STRUCTURE_COMMANDS = (ShowStructures, ChangeStructure, DeleteStructure)
COMMANDS: tuple[type[ClientMessage], ...] = (CaseCommand, RenameCase, *STRUCTURE_COMMANDS)
