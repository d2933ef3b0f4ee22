"""Compiled certificate of one link's motion, vertex by vertex, where the bound for the whole link is inconclusive.

That is the case where inscribed radii are small relative to the bound, and near the ends of a link's window. The proof
is lemma 7 of docs/safety.md, "The snake in its pathway".
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ...arrays import Array
from ...kernels.compiled import compiled
from ..packed import (
    AXIS,
    END,
    END_RADIUS,
    END_TANGENT,
    INSCRIBED_RADIUS,
    LIPSCHITZ,
    START,
    START_RADIUS,
    START_TANGENT,
)
from ..query.section import section_distance


@compiled
def far_from_disc(rows: Array, j: int, end: bool, frame: Array, low_high: Array, travel: float) -> bool:
    """Whether the disc of segment j's first contour, or its last, is more than ``travel`` from a box in a frame (3, 4).

    The box, ``low_high`` (6,) mm in that frame, is bounded by a ball, and a polar contour by its largest radius.
    """
    at, normal, size = (END, END_TANGENT, END_RADIUS) if end else (START, START_TANGENT, START_RADIUS)
    ball, along, square = 0.0, 0.0, 0.0
    x, y, z = (0.5 * (low_high[0] + low_high[3]), 0.5 * (low_high[1] + low_high[4]), 0.5 * (low_high[2] + low_high[5]))
    for i in range(3):
        half = 0.5 * (low_high[3 + i] - low_high[i])
        ball += half * half
        gap = frame[i, 0] * x + frame[i, 1] * y + frame[i, 2] * z + frame[i, 3] - rows[j, at + i]
        along += gap * rows[j, normal + i]
        square += gap * gap
    beside = sqrt(max(square - along * along, 0.0)) - rows[j, size]
    away = sqrt(along * along + max(beside, 0.0) * max(beside, 0.0))
    return away > sqrt(ball) + travel


@compiled
def vertices_are_kept(
    rows: Array,
    polar: Array,
    first: int,
    last: int,
    here: Array,
    there: Array,
    lanes: Array,
    block: int,
    end: int,
    low_high: Array,
    travel: float,
    shallow: float,
    rate: float,
    most: float,
) -> bool:
    """Whether no vertex of a link exceeds the depth ``most`` mm on the motion from one measured frame to another.

    Args:
        first, last: its window; segments whose outer disc the link can reach are excluded, which decreases no depth.
        here, there: (3, 4) frames; lanes: of ``vertex_blocks``, the link's are ``block`` to ``end`` - 1.
        low_high: (6,) its vertices' box; travel: mm, largest distance of a vertex from either of its two positions.
        shallow, rate: the Lipschitz constant ``rate`` Λ holds wherever a deviation is at most ``shallow``.
    """
    while first < last and not (
        far_from_disc(rows, first, False, here, low_high, travel)
        and far_from_disc(rows, first, False, there, low_high, travel)
    ):
        first += 1
    while first < last and not (
        far_from_disc(rows, last - 1, True, here, low_high, travel)
        and far_from_disc(rows, last - 1, True, there, low_high, travel)
    ):
        last -= 1
    if not first < last:
        return False
    for k in range(block, end):
        for lane in range(16):
            x, y, z = lanes[k, lane], lanes[k, 16 + lane], lanes[k, 32 + lane]
            one, steep = _growth(rows, polar, first, last, here, x, y, z, travel, shallow, rate)
            two, steeper = _growth(rows, polar, first, last, there, x, y, z, travel, shallow, rate)
            if not 0.5 * (one + two + max(steep, steeper) * travel) <= most:
                return False
    return True


@compiled
def _growth(
    rows: Array,
    polar: Array,
    first: int,
    last: int,
    frame: Array,
    a: float,
    b: float,
    c: float,
    travel: float,
    shallow: float,
    rate: float,
) -> tuple[float, float]:
    """Deviation of a vertex (a, b, c) of a link, and its largest growth per mm within ``travel`` mm of there."""
    x = frame[0, 0] * a + frame[0, 1] * b + frame[0, 2] * c + frame[0, 3]
    y = frame[1, 0] * a + frame[1, 1] * b + frame[1, 2] * c + frame[1, 3]
    z = frame[2, 0] * a + frame[2, 1] * b + frame[2, 2] * c + frame[2, 3]
    least, nearest = np.inf, first
    for j in range(first, last):
        gap = section_distance(x, y, z, rows, polar, j)[0]
        if not gap > 0.0:
            return 0.0, rate if rate * travel <= shallow else np.inf
        if gap < least:
            least, nearest = gap, j
    j, along, square = nearest, 0.0, 0.0
    for i in range(3):
        gap = (x if i == 0 else (y if i == 1 else z)) - rows[j, i]
        along += gap * rows[j, AXIS + i]
        square += gap * gap
    height = sqrt(max(square - along * along, 0.0)) - travel
    if not height > 0.0:
        return least, np.inf
    turned = 0.5 * rows[j, INSCRIBED_RADIUS] * sqrt(max(rows[j, LIPSCHITZ] * rows[j, LIPSCHITZ] - 1.0, 0.0)) / height
    return least, sqrt(1.0 + turned * turned)
