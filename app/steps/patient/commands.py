"""Commands of the Patient step."""

from __future__ import annotations

from typing import Literal

from app.messages.fields import Command, Identifier, Name


class CaseCommand(Command):
    type: Literal["case.open", "case.delete", "case.restore"]
    case_id: Identifier


class RenameCase(Command):
    type: Literal["case.rename"]
    case_id: Identifier
    name: Name


COMMANDS: tuple[type[Command], ...] = (CaseCommand, RenameCase)
