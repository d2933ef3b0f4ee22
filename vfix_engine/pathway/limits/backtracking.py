"""How far a refused motion is shortened: one ladder of shares for every step of the snake."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

S = TypeVar("S")

SHARES = (1.0, 0.5, 0.25, 0.1)


def largest_fraction(
    attempt: Callable[[S, float], tuple[S, bool]], state: S, part: Callable[[S], float]
) -> tuple[S, float]:
    """The state after the first of ``SHARES`` of a motion that is admissible, and that share; 0.0 where none is.

    Args:
        attempt: of a share of the motion: the state after it, and whether it was admissible.
        part: of the motion that a state refused last, the part beyond which a shorter one would be refused too, 1 where
            that is unknown; smaller shares are not tried.
    """
    most = 1.0
    for share in SHARES:
        if share <= most:
            state, admissible = attempt(state, share)
            if admissible:
                return state, share
            most = min(most, share * part(state))
    return state, 0.0
