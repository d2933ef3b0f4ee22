"""The section of the shaft's directions."""

from __future__ import annotations

from typing import TypedDict


class ShaftSection(TypedDict):
    """The shaft at the selected path point.

    point: its id, None where no path point is selected; aiming: the next click aims the shaft of that point.
    words: where the shaft leaves to, '' where the direction is left open. roll_deg: None where it is left open.
    bent: the tool has a bend, so that its roll matters. shown: the suggestion and alternative that the scene shows.
    """

    point: str | None
    aiming: bool
    words: str
    roll_deg: float | None
    bent: bool
    shown: str | None
