"""What a client says, read as operations: where several share an address or a message, those whose fields are there."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, get_args

import msgspec
from msgspec import UnsetType

from app.operations.operation import Operation
from app.operations.reading import Place, Unreadable, read

Field = tuple[Any, Any]  # its type, and its default or NODEFAULT
Keys = Callable[[type[Operation]], Mapping[str, str]]  # names of fields by the client's; 'fle.mm' of one within one


def keys_of(operation: type[Operation]) -> dict[str, str]:
    """As they are declared."""
    return {name: name for name in operation.__struct_fields__}


def fields_of(operations: Sequence[type[Operation]], keys: Keys = keys_of) -> dict[str, Field]:
    """What a client may say to ask for one of these, by its keys; of several each may be left out."""
    found: dict[str, Field] = {}
    alone = len(operations) == 1
    for operation in operations:
        for key, name in keys(operation).items():
            field = _field(operation, name)
            kind = _said(field.type)
            found[key] = (kind, field.default) if alone else (kind | None, None)
    return found


def _field(kind: type[msgspec.Struct], name: str) -> msgspec.structs.FieldInfo:
    outer, _, inner = name.partition(".")
    field = next(field for field in msgspec.structs.fields(kind) if field.name == outer)
    return _field(field.type, inner) if inner else field


def read_operations(
    operations: Sequence[type[Operation]],
    body: Mapping[str, Any],
    where: Place = (),
    keys: Keys = keys_of,
    of_all: Mapping[str, Any] | None = None,
) -> list[Operation]:
    """The operations that a body asks for: one that stands alone, or those of several that have a key in it.

    Where there are several, a null says nothing. of_all: values of fields that each of them has. Raises Unreadable.
    """
    of_all = of_all or {}
    if len(operations) == 1:
        return [_read(operations[0], {**body, **of_all}, where, keys)]
    known = {key for operation in operations for key in keys(operation)} - of_all.keys()
    if unknown := [key for key in body if key not in known]:
        raise Unreadable([((*where, key), "There is no such field") for key in unknown])
    found = []
    for operation in operations:
        names = keys(operation)
        said = {key: value for key, value in body.items() if key in names and value is not None}
        if said:
            found.append(_read(operation, {**said, **of_all}, where, keys))
    return found


def _read(operation: type[Operation], body: Mapping[str, Any], where: Place, keys: Keys) -> Operation:
    """The operation; what is wrong is told by the client's keys."""
    names, values = keys(operation), dict[str, Any]()
    problems = [((*where, key), "There is no such field") for key in body if key not in names]
    for key, name in names.items():
        if key in body:
            outer, _, inner = name.partition(".")
            if inner:
                values.setdefault(outer, {})[inner] = body[key]
            else:
                values[outer] = body[key]
    try:
        found = read(operation, values, where)
    except Unreadable as error:
        told = [((*where, *_said_at(place[len(where) :], names)), words) for place, words in error.problems]
        raise Unreadable(told + problems) from None
    if problems:
        raise Unreadable(problems)
    return found


def _said_at(place: Place, names: Mapping[str, str]) -> Place:
    """A place in an operation by the client's keys, of which one may be what the place is in."""
    for key, name in names.items():
        parts = tuple(name.split("."))
        if place and place[: len(parts)] == parts[: len(place)]:
            return (key, *place[len(parts) :])
    return place


def _said(kind: Any) -> Any:
    """The type of what may be said: UNSET, of a field whose null means something, says that it was left out."""
    kinds = [one for one in get_args(kind) if one is not UnsetType]
    return kind if UnsetType not in get_args(kind) else functools.reduce(operator.or_, kinds)
