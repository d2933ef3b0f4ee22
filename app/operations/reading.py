"""Values of JSON read as a declared type, with every place that is wrong instead of the first alone."""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

import msgspec

from app.operations.fields import REFUSED

T = TypeVar("T")
Place = tuple[str, ...]
Problem = tuple[Place, str]  # where, and what is wrong there


class Unreadable(ValueError):
    """A value is not of its type. problems: every place; the text is the first of them."""

    def __init__(self, problems: list[Problem]) -> None:
        self.problems = problems
        where, words = problems[0]
        super().__init__(f"{'.'.join(where)}: {words}" if where else words)


def read(kind: type[T], data: Any, where: Place = (), strict: bool = True) -> T:
    """The value: no text is a number, unless not strict, and no field is unknown. where: the place of the whole.

    Raises Unreadable.
    """
    try:
        return msgspec.convert(data, kind, strict=strict)
    except msgspec.ValidationError as error:
        raise Unreadable(list(_of_parts(kind, data, where, strict)) or [(where, _words(kind, data, error))]) from None


def _problems(kind: Any, data: Any, where: Place, strict: bool) -> Iterator[Problem]:
    """msgspec tells the first: where it tells one, the parts are read one by one, as deep as there are some."""
    try:
        msgspec.convert(data, kind, strict=strict)
    except msgspec.ValidationError as error:
        yield from list(_of_parts(kind, data, where, strict)) or [(where, _words(kind, data, error))]


def _words(kind: Any, data: Any, error: msgspec.ValidationError) -> str:
    """What is wrong with a value that has no parts."""
    words = str(error).split(" - at `")[0]
    text = isinstance(data, str) and "`str`" in words  # not a number, which a command line has as a text too
    beyond = " matching regex " in words if text else ", got `" not in words
    if not beyond or not (refused := _refused(kind)):
        return words
    return refused.format(float(data) if isinstance(data, str) and not text else data)


def _refused(kind: Any) -> str:
    """What a type says of what is beyond its bounds; '' where it says nothing."""
    arguments = get_args(kind)
    if get_origin(kind) is Annotated:
        notes = (note.extra or {} for note in arguments[1:] if isinstance(note, msgspec.Meta))
        return next((str(note[REFUSED]) for note in notes if REFUSED in note), "")
    return next((words for inner in arguments if (words := _refused(inner))), "")


def _of_parts(kind: Any, data: Any, where: Place, strict: bool) -> Iterator[Problem]:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        yield from _of_parts(arguments[0], data, where, strict)
    elif origin in (Union, types.UnionType):
        others = [one for one in arguments if one not in (type(None), msgspec.UnsetType)]
        if len(others) == 1 and data is not None:
            yield from _of_parts(others[0], data, where, strict)
    elif isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        if isinstance(data, Mapping):
            yield from _of_fields(kind, data, where, strict)
    elif origin in (list, tuple) and isinstance(data, list):
        kinds = arguments if origin is tuple and Ellipsis not in arguments else (arguments[0],) * len(data)
        if len(kinds) == len(data):
            for index, (inner, value) in enumerate(zip(kinds, data, strict=True)):
                yield from _problems(inner, value, (*where, str(index)), strict)


def _of_fields(kind: type[msgspec.Struct], data: Mapping[str, Any], where: Place, strict: bool) -> Iterator[Problem]:
    fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
    for name, field in fields.items():
        if name in data:
            yield from _problems(field.type, data[name], (*where, name), strict)
        elif field.required:
            yield (*where, name), "Field required"
    for name in data.keys() - fields.keys():
        yield (*where, str(name)), "There is no such field"
