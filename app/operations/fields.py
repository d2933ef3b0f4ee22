"""Types of fields with their bounds (HAZ-05); numbers are finite, since nothing else is read as one."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from app.kit.names import COLOUR, MAX_NAME, MAX_TEXT
from app.kit.values import MAX_COORDINATE

_END = r"$(?!\n)"  # `$` alone is before a last line break too


def whole(pattern: str) -> str:
    """A pattern that a whole text has to match."""
    return f"^{pattern}{_END}"


def shown_pattern(pattern: str) -> str:
    """A pattern as other programs read it, whose `$` is the end."""
    return pattern.replace(_END, "$")


REFUSED = "refused"  # in `extra`: what is said of a number beyond its bounds, which stands for {}, or of such a text
STRIPPED = "stripped"  # in `extra`: blanks around it are taken off where a page sends it

_KEPT = r"[\w.\-]"  # of an identifier that is stored: letters of any alphabet

Identifier = Annotated[str, Meta(min_length=1, max_length=64, pattern=whole(r"[A-Za-z0-9_.\-]+"))]
Name = Annotated[str, Meta(min_length=1, max_length=MAX_NAME, extra={STRIPPED: True})]
# Of several lines: without controls, lone surrogates, separators and characters that reorder, as `check_text`.
Text = Annotated[
    str,
    Meta(
        max_length=MAX_TEXT,
        pattern=whole(r"[^\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]*"),
        extra={REFUSED: "the text holds a control character; use letters, digits, signs and line breaks."},
    ),
]
Colour = Annotated[str, Meta(pattern=whole(COLOUR))]
Revision = Annotated[int, Meta(ge=0, le=2**53)]
StoredId = Annotated[str, Meta(min_length=1, max_length=64, pattern=whole(f"{_KEPT}+"))]
MaybeId = Annotated[str, Meta(max_length=64, pattern=whole(f"{_KEPT}*"))]  # '' for none
StoredCoordinate = Annotated[float, Meta(gt=-MAX_COORDINATE, lt=MAX_COORDINATE)]  # [mm]
Place = tuple[StoredCoordinate, StoredCoordinate, StoredCoordinate]  # as documents have it, [mm]
Coordinate = Annotated[float, Meta(ge=-1e4, le=1e4)]  # [mm]
Position = tuple[Coordinate, Coordinate, Coordinate]  # LPS [mm]
