"""Every command that a client may send, validated at the door (HAZ-05): numbers are finite and bounded, names short."""

from __future__ import annotations

import functools
import operator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, TypeAdapter

from app.messages.fields import Command, Identifier
from app.tabs import registry
from app.workspace import commands as workspace


def _known_tab(name: str) -> str:
    if name not in [spec.name for spec in registry.specs()]:
        raise ValueError("there is no such step")
    return name


class SetTab(Command):
    type: Literal["step.set"]
    name: Annotated[Identifier, AfterValidator(_known_tab)]


def commands() -> tuple[type[Command], ...]:
    """Every command: the session's own, those for what all tabs share, and those of each tab."""
    return (SetTab, *workspace.COMMANDS, *(command for spec in registry.specs() for command in spec.commands))


@functools.cache
def _adapter() -> TypeAdapter[Command]:
    union: Any = functools.reduce(operator.or_, commands())
    return TypeAdapter(Annotated[union, Field(discriminator="type")])


def parse_command(text: str | bytes) -> Command:
    """Parse one message; raises pydantic's ``ValidationError`` for anything that is not a known, bounded command."""
    return _adapter().validate_json(text)
