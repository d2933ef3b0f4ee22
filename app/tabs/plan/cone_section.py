"""The section of the cones on the targets."""

from __future__ import annotations

from typing import Literal, TypedDict


class ConeView(TypedDict):
    """A target, and the full opening angle of the round cone of all directions from which it can be inspected."""

    target: str
    cone_deg: float
    words: str


class ConeSection(TypedDict):
    """The cones of the targets of the open plan.

    state: 'current', of the stored path and targets; 'waits' while others than these are computed, the items being of
    before; 'none' where there is nothing to tell.
    """

    state: Literal["none", "waits", "current"]
    items: list[ConeView]
