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
Keys = Callable[[type[Operation]], Mapping[str, str]]  # names of fields by those that the client uses


def keys_of(operation: type[Operation]) -> dict[str, str]:
    """As they are declared."""
    return {name: name for name in operation.__struct_fields__}


def fields_of(operations: Sequence[type[Operation]], keys: Keys = keys_of) -> dict[str, Field]:
    """What a client may say to ask for one of these, by its keys; of several each may be left out."""
    found: dict[str, Field] = {}
    alone = len(operations) == 1
    for operation in operations:
        of = {name: key for key, name in keys(operation).items()}
        for field in msgspec.structs.fields(operation):
            if field.name not in of:
                continue
            kind = _said(field.type)
            found[of[field.name]] = (kind, field.default) if alone else (kind | None, None)
    return found


def read_operations(
    operations: Sequence[type[Operation]],
    body: Mapping[str, Any],
    where: Place = (),
    keys: Keys = keys_of,
    of_all: dict[str, Any] | None = None,
) -> list[Operation]:
    """The operations that a body asks for: one that stands alone, or those of several that have a key in it.

    Where there are several, a null says nothing. of_all: values of fields that each of them has. Raises Unreadable.
    """
    of_all = of_all or {}
    if len(operations) == 1:
        names = keys(operations[0])
        return [read(operations[0], {names.get(key, key): value for key, value in body.items()} | of_all, where)]
    known = {key for operation in operations for key in keys(operation)} - of_all.keys()
    if unknown := [key for key in body if key not in known]:
        raise Unreadable([((*where, key), "There is no such field") for key in unknown])
    found = []
    for operation in operations:
        names = keys(operation)
        values = {names[key]: value for key, value in body.items() if key in names and value is not None}
        if values:
            found.append(read(operation, values | of_all, where))
    return found


def _said(kind: Any) -> Any:
    """The type of what may be said: UNSET, of a field whose null means something, says that it was left out."""
    kinds = [one for one in get_args(kind) if one is not UnsetType]
    return kind if UnsetType not in get_args(kind) else functools.reduce(operator.or_, kinds)
