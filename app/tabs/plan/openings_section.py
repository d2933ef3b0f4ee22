"""The section of the openings at which an empty path can begin."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.messages.sections import Position


class OpeningView(TypedDict):
    """An opening; side: '', 'left' or 'right' of the patient; radius_mm: of the largest ball in it."""

    id: str
    name: str
    side: str
    position: Position
    radius_mm: float


class OpeningsSection(TypedDict):
    """The openings of the head while the chosen path has no point.

    state: 'waiting' while they are looked for, 'current' once they are known, 'none' where they are not asked for.
    marked: a click on one is its choice. words: what to do where none was found, else ''.
    """

    state: Literal["none", "waiting", "current"]
    items: list[OpeningView]
    marked: bool
    words: str


class OpeningSections(TypedDict):
    """What the Plan tab shows of openings."""

    openings: OpeningsSection
