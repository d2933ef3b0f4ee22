"""The windows of the pathway in which the links of a driven snake are measured, and the links that count."""

from __future__ import annotations

import numpy as np

from ....arrays import Array, IntArray
from ....pathway.packed import END, START, PackedPathway
from ....pathway.pathway import Pathway
from ....robots.snake import SnakeModel

WINDOW_MM = 40.0  # [mm] of the pathway before and behind a link that belong to its window
_AHEAD = 2.0  # shape samples, and mm at least: a planned shape keeps the bounds that apply within this distance


def link_windows(pathway: Pathway, joint_s: Array, first: int, margin_mm: float = 0.0) -> IntArray:
    """Windows (L, 2) of segments for joints at the arc lengths (L + 1,) in mm; links from ``first`` on share one.

    margin_mm: extension at either end.

    Raises:
        PathwayError: joints that are not in order, or not at a finite arc length.
    """
    around = WINDOW_MM + margin_mm
    low, high = joint_s[:-1] - around, joint_s[1:] + around
    low[first:], high[first:] = low[first], high[-1]
    return pathway.windows(low, high)


def planning_margin(spacing_mm: float) -> float:
    """Extension in mm of the windows whose bounds a planned shape keeps, with shapes ``spacing_mm`` apart.

    A bound decreases when the window reaches a narrower position, and the link has to be within it before: the shapes
    that lead there are planned for it.
    """
    return max(_AHEAD * spacing_mm, _AHEAD)


def entrance(packed: PackedPathway, snake: SnakeModel) -> float:
    """Arc length in mm beyond which a link's near joint is inside the straight piece before the first contour."""
    straight = float(np.linalg.norm(packed.rows[0, END : END + 3] - packed.rows[0, START : START + 3]))
    return snake.radius_mm - straight
