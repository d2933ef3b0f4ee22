"""Commands of a plan's versions."""

from __future__ import annotations

from typing import Literal

from app.messages.fields import Command, Identifier, Name


class SaveVersion(Command):
    type: Literal["version.save"]
    name: Name


class VersionCommand(Command):
    """compare: show what changed since it; again, or of another one, it is hidden."""

    type: Literal["version.compare", "version.go_back", "version.delete", "version.restore"]
    version_id: Identifier


class RenameVersion(Command):
    type: Literal["version.rename"]
    version_id: Identifier
    name: Name


VERSION_COMMANDS: tuple[type[Command], ...] = (SaveVersion, VersionCommand, RenameVersion)
