"""The first message of a client: the version of the messages that it speaks, and its role."""

from __future__ import annotations

from typing import Literal

from pydantic import ValidationError

from app.messages.client import ClientRole
from app.messages.fields import ClientMessage
from app.messages.version import VERSION
from vfix_engine.json_text import parse_json


class Hello(ClientMessage):
    type: Literal["hello"]
    version: int
    role: ClientRole = "watches"


class NotUnderstood(Exception):
    """The client speaks another version, or did not say which; the text says what to do."""


def read_hello(text: str) -> Hello:
    """The hello that a client begins with. Raises NotUnderstood, also where its other fields are of another version."""
    try:
        message = parse_json(text)
    except ValueError:
        message = None
    version = message.get("version") if isinstance(message, dict) and message.get("type") == "hello" else None
    if version is None:
        raise NotUnderstood(f"say hello first, with version {VERSION}")
    if type(version) is not int or version != VERSION:
        raise NotUnderstood(f"the planner speaks version {VERSION}; reload the page")
    try:
        return Hello.model_validate_json(text)
    except ValidationError as error:
        problem = error.errors(include_url=False, include_context=False, include_input=False)[0]
        raise NotUnderstood(f"hello: {'.'.join(map(str, problem['loc']))}: {problem['msg']}"[:120]) from None
