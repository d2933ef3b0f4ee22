"""Every command that a client may send, validated on receipt (HAZ-05): numbers are finite and bounded, names short."""

from __future__ import annotations

import functools
import operator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError

from app.messages.fields import ClientMessage, Identifier
from app.operations.messages import OperationMessage, read_message
from app.tabs import registry
from app.workspace import commands as workspace
from vfix_engine.json_text import parse_json


def _known_tab(name: str) -> str:
    if name not in [spec.name for spec in registry.specs()]:
        raise ValueError("there is no such tab")
    return name


class SetTab(ClientMessage):
    type: Literal["step.set"]
    name: Annotated[Identifier, AfterValidator(_known_tab)]


def commands() -> tuple[type[ClientMessage], ...]:
    """Every command: the session's own, those for what all tabs share, and those of each tab."""
    of_tabs = [command for spec in registry.specs() for command in spec.commands]
    return (SetTab, *workspace.COMMANDS, *dict.fromkeys(of_tabs))


@functools.cache
def _adapter() -> TypeAdapter[ClientMessage]:
    union: Any = functools.reduce(operator.or_, commands())
    return TypeAdapter(Annotated[union, Field(discriminator="type")])


class InvalidMessage(ValueError):
    """The text is neither a command nor an operation; the message names the first error."""


def parse_command(text: str | bytes) -> ClientMessage | OperationMessage:
    """Parse one message. Raises InvalidMessage for anything that is not a known, bounded command or operation."""
    try:
        message = parse_json(text)
        operation = read_message(message) if isinstance(message, dict) else None
        return operation or _adapter().validate_python(message)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]["msg"]
        raise InvalidMessage(first) from None
    except ValueError as error:
        raise InvalidMessage(str(error)) from None
