"""How far a refused motion is shortened: one ladder of shares for every step of the snake."""

from __future__ import annotations

from collections.abc import Callable

SHARES = (1.0, 0.5, 0.25, 0.1)


def largest_share(is_admissible: Callable[[float], bool]) -> float:
    """The first of ``SHARES`` that is admissible; 0.0 where none is. Smaller ones are not asked."""
    return next((share for share in SHARES if is_admissible(share)), 0.0)
