"""How the compiled query goes down a link's tree: what need not be measured is left out, exactly.

A point is inside of a segment that it is between the planes of and below the wall of (``inner_line.py``), and for
eq. 9 a plate of vertices that cannot deviate more than one vertex does is of no account. ``work`` is the scratch
memory of ``query_lanes.py``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing
from .polar_lanes import put_least_radii, put_radii, raise_polar_bounds
from .query_blocks import CHILD, WHOLE
from .query_lanes import (
    AT,
    FRAME,
    GAP,
    LEVEL,
    STEP,
    lower_gaps,
    most,
    put_circles,
    put_normals,
    put_places,
    raise_bounds,
    raise_ends,
)
from .section import section_distance

Array = NDArray[np.float64]

FARTHEST = 1e100  # [mm] beyond it squares overflow; such a place is no place


@borrowing
def ahead(rows: Array, j: int, end: int, x: float, y: float, z: float) -> float:
    """How far a point in mm lies beyond the plane of the first (0) or last (1) contour of segment ``j``."""
    far: float = (
        (x - rows[j, 3 * end]) * rows[j, 6 + 3 * end]
        + (y - rows[j, 3 * end + 1]) * rows[j, 7 + 3 * end]
        + (z - rows[j, 3 * end + 2]) * rows[j, 8 + 3 * end]
    )
    return far


@borrowing
def span(
    rows: Array, x: float, y: float, z: float, radius: float, near: int, first: int, last: int
) -> tuple[int, int, int]:
    """The segment that a ball's centre lies in, walking from ``near``, and the first and last that the ball may be in.

    All of the ball is ahead of the first one's first plane and before the last one's last plane, or these are the
    window's ends: so every point of it is between the planes of one of them.
    """
    j = min(max(near, first), last - 1)
    while j + 1 < last and ahead(rows, j, 1, x, y, z) > 0.0:
        j += 1
    while j > first and ahead(rows, j, 0, x, y, z) < 0.0:
        j -= 1
    low, high = j, j
    while low > first and ahead(rows, low, 0, x, y, z) < radius:
        low -= 1
    while high + 1 < last and ahead(rows, high, 1, x, y, z) > -radius:
        high += 1
    return j, low, high


@borrowing
def enter(
    rows: Array,
    polar: Array,
    ball: Array,
    node: int,
    near: int,
    first: int,
    last: int,
    least: float,
    work: Array,
    level: int,
) -> None:
    """Bound what the 16 children of a node may deviate; kept in ``work`` with the node and its segment.

    What does not deviate more than ``least`` need not be bounded sharply.
    """
    at = LEVEL + STEP * level
    a, b, c = ball[node, WHOLE], ball[node, WHOLE + 1], ball[node, WHOLE + 2]
    x = work[FRAME] * a + work[FRAME + 1] * b + work[FRAME + 2] * c + work[FRAME + 3]
    y = work[FRAME + 4] * a + work[FRAME + 5] * b + work[FRAME + 6] * c + work[FRAME + 7]
    z = work[FRAME + 8] * a + work[FRAME + 9] * b + work[FRAME + 10] * c + work[FRAME + 11]
    j, low, high = span(rows, x, y, z, ball[node, WHOLE + 3], near, first, last)
    put_places(ball, node, work)
    put_normals(ball, node, work)
    for k in range(at, at + 16):
        work[k] = 0.0
    for i in range(low, high + 1):
        raise_bounds(ball, node, rows, i, work, at)
    if polar.shape[1] > 1 and most(work, at) > least:  # the line below the whole wall does not do
        for k in range(at, at + 16):
            work[k] = 0.0
        for i in range(low, high + 1):
            put_least_radii(ball, node, rows, polar, i, work)
            raise_polar_bounds(ball, node, rows, i, work, at)
    if low == first and ahead(rows, first, 0, x, y, z) < ball[node, WHOLE + 3]:
        raise_ends(ball, node, rows, first, 0, work, at)
    if high + 1 == last and ahead(rows, last - 1, 1, x, y, z) > -ball[node, WHOLE + 3]:
        raise_ends(ball, node, rows, last - 1, 1, work, at)
    work[at + 16], work[at + 17] = float(node), float(j)


@borrowing
def lower(rows: Array, polar: Array, j: int, work: Array) -> None:
    if polar.shape[1] == 1:
        put_circles(rows, j, work)
    else:
        put_radii(rows, polar, j, work)
    lower_gaps(rows, j, work)


@borrowing
def measure(
    rows: Array, polar: Array, lanes: Array, block: int, near: int, first: int, last: int, least: float, work: Array
) -> float:
    """The largest δ_i of eq. 8 of a block's vertices in mm; where it is over ``least``, ``work`` has all of them."""
    a, b, c, radius = lanes[block, 48], lanes[block, 49], lanes[block, 50], lanes[block, 51]
    x = work[FRAME] * a + work[FRAME + 1] * b + work[FRAME + 2] * c + work[FRAME + 3]
    y = work[FRAME + 4] * a + work[FRAME + 5] * b + work[FRAME + 6] * c + work[FRAME + 7]
    z = work[FRAME + 8] * a + work[FRAME + 9] * b + work[FRAME + 10] * c + work[FRAME + 11]
    _, low, high = span(rows, x, y, z, radius, near, first, last)
    put_places(lanes, block, work)
    for k in range(16):
        work[GAP + k], work[AT + k] = np.inf, float(first)
    for j in range(low, high + 1):
        lower(rows, polar, j, work)
    far: float = np.sqrt(most(work, GAP))
    j = first
    while far > least and j < last:
        if j == low:
            j = high + 1
            continue
        u, v, w = rows[j, 14] - x, rows[j, 15] - y, rows[j, 16] - z
        reach = far + rows[j, 17] + radius
        if u * u + v * v + w * w < reach * reach:
            lower(rows, polar, j, work)
            far = np.sqrt(most(work, GAP))
        j += 1
    return far


@borrowing
def every_of_block(
    rows: Array, polar: Array, lanes: Array, block: int, near: int, first: int, last: int, work: Array
) -> int:
    """δ_i in mm and segments of a block's vertices into ``work``; where it lies.

    A ball that is below the lines of all segments it may be in is inside of them.
    """
    a, b, c, radius = lanes[block, 48], lanes[block, 49], lanes[block, 50], lanes[block, 51]
    x = work[FRAME] * a + work[FRAME + 1] * b + work[FRAME + 2] * c + work[FRAME + 3]
    y = work[FRAME + 4] * a + work[FRAME + 5] * b + work[FRAME + 6] * c + work[FRAME + 7]
    z = work[FRAME + 8] * a + work[FRAME + 9] * b + work[FRAME + 10] * c + work[FRAME + 11]
    j, low, high = span(rows, x, y, z, radius, near, first, last)
    inside = ahead(rows, low, 0, x, y, z) >= radius and ahead(rows, high, 1, x, y, z) <= -radius
    for i in range(low, high + 1):
        px, py, pz = x - rows[i, 0], y - rows[i, 1], z - rows[i, 2]
        t = px * rows[i, 19] + py * rows[i, 20] + pz * rows[i, 21]
        h = np.sqrt(max(px * px + py * py + pz * pz - t * t, 0.0)) + 1e-6
        inside = inside and h + radius * rows[i, 39] <= rows[i, 36] + rows[i, 37] * t
    if not inside:
        measure(rows, polar, lanes, block, j, first, last, 0.0, work)
        for k in range(16):
            work[GAP + k] = np.sqrt(work[GAP + k])
        return j
    for k in range(16):
        work[GAP + k], work[AT + k] = 0.0, float(low)
    if low < high:
        put_places(lanes, block, work)
        for k in range(16):
            i = low
            while i < high and ahead(rows, i, 1, work[k], work[16 + k], work[32 + k]) > 0.0:
                i += 1
            work[AT + k] = float(i)
    return j


@borrowing
def deepest(
    rows: Array,
    polar: Array,
    lanes: Array,
    ball: Array,
    link: int,
    near: int,
    first: int,
    last: int,
    least: float,
    once: bool,
    work: Array,
) -> tuple[float, int, int, int]:
    """The largest δ_i of a link that is over ``least``, its block, lane and segment; block -1 where none is.

    With ``once`` any one that is over. Nodes and blocks are taken in the order of what they may deviate.
    """
    block, lane, segment = -1, 0, near
    level = 0
    enter(rows, polar, ball, link, near, first, last, least, work, 0)
    while level >= 0:
        at = LEVEL + STEP * level
        bound = most(work, at)
        if not bound > least:
            level -= 1
            continue
        k = 0
        while work[at + k] < bound:
            k += 1
        work[at + k] = 0.0
        child, j = int(ball[int(work[at + 16]), CHILD + k]), int(work[at + 17])
        if child >= 0:
            level += 1
            enter(rows, polar, ball, child, j, first, last, least, work, level)
            continue
        far = measure(rows, polar, lanes, -1 - child, j, first, last, least, work)
        if far > least:
            least, block, lane = far, -1 - child, 0
            squared = most(work, GAP)
            while work[GAP + lane] < squared:
                lane += 1
            segment = int(work[AT + lane])
            if once:
                break
    return least, block, lane, segment


@borrowing
def take_frame(frames: Array, row: int, work: Array) -> bool:
    """A frame into ``work``; whether it is of numbers."""
    size = 0.0
    for i in range(3):
        for k in range(4):
            work[FRAME + 4 * i + k] = frames[row, i, k]
            size += abs(frames[row, i, k])
    return size < FARTHEST


@borrowing
def containing(
    rows: Array, polar: Array, lanes: Array, block: int, near: int, first: int, last: int, work: Array
) -> int:
    """A segment that the first vertex of a block is inside of, which is inside of one."""
    put_places(lanes, block, work)
    x, y, z = work[0], work[16], work[32]
    _, low, high = span(rows, x, y, z, 1e-6, near, first, last)
    while low < high and section_distance(x, y, z, rows, polar, low)[0] > 0.0:
        low += 1
    return low
