"""JSON schemas of operations and of what they answer, for OpenAPI."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from typing import Any

import msgspec
from msgspec import NODEFAULT

from app.operations.bodies import Field
from app.operations.fields import shown_pattern

REFERENCE = "#/components/schemas/{name}"


def schemas_of(kinds: Iterable[Any]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """The schema of each type, and the named ones that they refer to."""
    found, components = msgspec.json.schema_components(list(kinds), ref_template=REFERENCE)
    return [_plain(one) for one in found], {name: _plain(one) for name, one in components.items()}


def object_schema(fields: Mapping[str, Field]) -> tuple[dict[str, Any], dict[str, Any]]:
    """The schema of an object with these fields and no others, and the named ones that it refers to."""
    entries = [
        (name, kind) if default is NODEFAULT else (name, kind, default) for name, (kind, default) in fields.items()
    ]
    made = msgspec.defstruct("Object", entries, kw_only=True, forbid_unknown_fields=True)
    _, components = schemas_of([made])
    schema = components.pop("Object")
    del schema["title"]
    if not schema["required"]:
        del schema["required"]
    return schema, components


def _plain(schema: Any) -> Any:
    """As OpenAPI of the other routes says the same."""
    if isinstance(schema, list):
        return [_plain(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    plain = {key: _plain(value) for key, value in schema.items() if not (key == "default" and value is None)}
    if isinstance(plain.get("description"), str):
        plain["description"] = inspect.cleandoc(plain["description"])
    if plain.get("items") is False:  # of a tuple, whose entries are said one by one
        del plain["items"]
    if isinstance(words := plain.get("enum"), list) and all(isinstance(word, str) for word in words):
        plain["type"] = "string"
    if isinstance(plain.get("pattern"), str):
        plain["pattern"] = shown_pattern(plain["pattern"])
    return plain
