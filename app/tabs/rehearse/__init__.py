"""Rehearse: a robot that clients share, one of which holds its handle."""

from app.tabs.rehearse.commands import COMMANDS
from app.tabs.rehearse.sections import RehearsalSections
from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "rehearse",
    "Rehearse",
    30,
    __name__,
    "RehearseTab",
    COMMANDS,
    RehearsalSections,
    input="drive",
    has_routes=True,
    kinds=("head",),
    needs="plan",
    endoscope="offered",
)
