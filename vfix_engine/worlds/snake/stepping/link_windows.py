"""What of a pathway the links of a driven snake are measured against, and which links count."""

from __future__ import annotations

import numpy as np

from ....arrays import Array, IntArray
from ....pathway.packed import END, START, PackedPathway
from ....pathway.pathway import Pathway
from ....robots.snake import SnakeModel

WINDOW_MM = 40.0  # [mm] of the pathway before and behind a link that it is measured against
_AHEAD = 2.0  # shape samples, and mm at least: so far around a planned shape bounds are those that it is about to get


def link_windows(pathway: Pathway, joint_s: Array, first: int, margin_mm: float = 0.0) -> IntArray:
    """Windows (L, 2) of segments for joints at the arc lengths (L + 1,) in mm; links from ``first`` on share one.

    margin_mm: so much longer at either end.

    Raises:
        PathwayError: joints that do not lie one after the other, or at no finite place.
    """
    around = WINDOW_MM + margin_mm
    low, high = joint_s[:-1] - around, joint_s[1:] + around
    low[first:], high[first:] = low[first], high[-1]
    return pathway.windows(low, high)


def planning_margin(spacing_mm: float) -> float:
    """How much longer windows are, mm, whose bounds a planned shape keeps, with shapes ``spacing_mm`` apart.

    A bound shrinks when the window comes to a narrower place, and the link has to be within it before: the shapes that
    lead there are planned for it.
    """
    return max(_AHEAD * spacing_mm, _AHEAD)


def entrance(packed: PackedPathway, snake: SnakeModel) -> float:
    """Arc length in mm from which on a link's near joint is inside the straight piece before the first contour."""
    straight = float(np.linalg.norm(packed.rows[0, END : END + 3] - packed.rows[0, START : START + 3]))
    return snake.radius_mm - straight
