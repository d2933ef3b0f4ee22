"""How far a refused motion is shortened: one ladder of shares for every step of the snake."""

from __future__ import annotations

from collections.abc import Callable

SHARES = (1.0, 0.5, 0.25, 0.1)


def largest_fraction(is_admissible: Callable[[float], bool], part: Callable[[], float]) -> float:
    """The first of ``SHARES`` that is admissible; 0.0 where none is. Smaller ones are not asked.

    part: of the motion refused last, the part beyond which a shorter one would be refused too, 1 where that is unknown.
    """
    most = 1.0
    for share in SHARES:
        if share <= most:
            if is_admissible(share):
                return share
            most = min(most, share * part())
    return 0.0
