"""Reader of untrusted XML: no DTD, no entities, no external files (HAZ-20)."""

from __future__ import annotations

import xml.parsers.expat as expat
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NoReturn

from ..errors import RobotError

MAX_DEPTH = 64
MAX_ELEMENTS = 20_000


@dataclass(frozen=True, eq=False, slots=True)
class Element:
    """An element with its attributes and children; text between elements is dropped."""

    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """Children with that tag, in order."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """The child with that tag, or None."""
        return next(self.all(tag), None)


class _Refused(Exception):
    """Carries the reason out of expat's callbacks."""


def read_xml(data: bytes) -> Element:
    """Return the root element of an XML document.

    A document type declaration is refused at its start, before any entity is declared.

    Raises:
        RobotError: the XML is not well-formed, has a document type or entity, is too deep or has too many elements.
    """
    parser = expat.ParserCreate()
    root: list[Element] = []
    stack: list[Element] = []
    count = 0

    def refuse(*_: object) -> NoReturn:
        raise _Refused("it declares a document type (DTD) or entity, which a robot does not need")

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if len(stack) >= MAX_DEPTH:
            raise _Refused(f"its elements are nested deeper than {MAX_DEPTH}")
        if count > MAX_ELEMENTS:
            raise _Refused(f"it has more than {MAX_ELEMENTS:,} elements")
        element = Element(tag, attributes)
        (stack[-1].children if stack else root).append(element)
        stack.append(element)

    def end(_: str) -> None:
        stack.pop()

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.UnparsedEntityDeclHandler = refuse
    parser.ExternalEntityRefHandler = refuse
    parser.SkippedEntityHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    try:
        parser.Parse(data, True)
    except _Refused as refused:
        raise RobotError(f"the XML is refused: {refused}") from None
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise RobotError(f"the file is not well-formed XML: {error}") from None
    return root[0]
