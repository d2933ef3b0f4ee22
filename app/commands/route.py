"""`vfix route`: list, make and edit routes through a lumen."""

from __future__ import annotations

from app.commands.documents import DocumentCommand
from app.lumen.operations import SPEC

_COMMAND = DocumentCommand("route", SPEC)
add_parser, run = _COMMAND.add_parser, _COMMAND.run
