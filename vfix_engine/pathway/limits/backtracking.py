"""Backtracking: the fractions to which a refused motion of the snake is shortened, common to all steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

S = TypeVar("S")

SHARES = (1.0, 0.5, 0.25, 0.1)


def largest_fraction(
    attempt: Callable[[S, float], tuple[S, bool]], state: S, part: Callable[[S], float]
) -> tuple[S, float]:
    """Return the state after the first of ``SHARES`` that is admissible, and that share; 0.0 if none is.

    Args:
        attempt: for a share of the motion, the state after it and whether it was admissible.
        part: for a state that refused a motion, the fraction of the motion beyond which a shorter one would be refused
            too, 1 if unknown; smaller shares are not tested.
    """
    most = 1.0
    for share in SHARES:
        if share <= most:
            state, admissible = attempt(state, share)
            if admissible:
                return state, share
            most = min(most, share * part(state))
    return state, 0.0
