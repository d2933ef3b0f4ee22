"""Backtracking: the fractions to which a refused motion of the snake is shortened, common to all steps."""

from __future__ import annotations

from collections.abc import Callable

SHARES = (1.0, 0.5, 0.25, 0.1)


def largest_fraction(is_admissible: Callable[[float], bool], part: Callable[[], float]) -> float:
    """Return the first of ``SHARES`` that is admissible; 0.0 if none is. Smaller ones are not tested.

    part: fraction of the last refused motion beyond which a shorter one would be refused too, 1 if unknown.
    """
    most = 1.0
    for share in SHARES:
        if share <= most:
            if is_admissible(share):
                return share
            most = min(most, share * part())
    return 0.0
