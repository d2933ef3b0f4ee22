"""Rehearse: a robot that clients share, one of which holds its handle."""

from app.steps.rehearse.commands import COMMANDS
from app.steps.rehearse.sections import RehearsalSections
from app.steps.spec import StepSpec

SPEC = StepSpec(
    "rehearse", "Rehearse", 30, __name__, "RehearseStep", COMMANDS, RehearsalSections, input="drive", has_routes=True
)
