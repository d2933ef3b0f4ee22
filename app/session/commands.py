"""Every command that a client may send, validated at the door (HAZ-05): numbers are finite and bounded, names short."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from app.messages.fields import Command
from app.messages.sections import StepName
from app.steps.patient import commands as patient
from app.steps.plan import commands as plan
from app.steps.rehearse import commands as rehearse
from app.views import commands as views


class SetStep(Command):
    type: Literal["step.set"]
    name: StepName


COMMANDS: tuple[type[Command], ...] = (
    SetStep,
    *views.COMMANDS,
    *patient.COMMANDS,
    *plan.COMMANDS,
    *rehearse.COMMANDS,
)
_UNION: Any = reduce(or_, COMMANDS)
_ADAPTER: TypeAdapter[Command] = TypeAdapter(Annotated[_UNION, Field(discriminator="type")])


def parse_command(text: str | bytes) -> Command:
    """Parse one message; raises pydantic's ``ValidationError`` for anything that is not a known, bounded command."""
    return _ADAPTER.validate_json(text)
