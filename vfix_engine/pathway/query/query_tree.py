"""Traversal of a link's tree in the compiled query, which exactly excludes what need not be measured.

A point is inside if it is between the planes of a segment and below its wall (``inner_line.py``), and for eq. 9 a ball
of vertices that cannot deviate more than an already measured vertex is irrelevant. ``work`` is the scratch memory of
``query_simd.py``.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kernels.compiled import no_refcount
from ..packed import PackedPathway
from .polar_simd import put_radii
from .query_blocks import CHILD, WHOLE, VertexBlocks
from .query_simd import (
    AT,
    FRAME,
    GAP,
    HERE,
    HIGH,
    LEVEL,
    LOW,
    NODE,
    STEP,
    lower_gaps,
    most,
    put_circles,
    put_places,
    raise_bounds,
    raise_ends,
)
from .section import section_distance

FARTHEST = 1e100  # [mm] limit of coordinates, above which squares overflow


@no_refcount
def ahead(rows: Array, j: int, end: int, x: float, y: float, z: float) -> float:
    """Signed distance in mm of a point beyond the plane of the first (0) or last (1) contour of segment ``j``."""
    far: float = (
        (x - rows[j, 3 * end]) * rows[j, 6 + 3 * end]
        + (y - rows[j, 3 * end + 1]) * rows[j, 7 + 3 * end]
        + (z - rows[j, 3 * end + 2]) * rows[j, 8 + 3 * end]
    )
    return far


@no_refcount
def span(
    rows: Array, x: float, y: float, z: float, radius: float, near: int, first: int, last: int
) -> tuple[int, int, int]:
    """Segment of a ball's centre, searched from ``near``, and the first and last segment that the ball can intersect.

    The whole ball is ahead of the first one's first plane and before the last one's last plane, unless these are the
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


@no_refcount
def moved(source: Array, row: int, at: int, work: Array) -> tuple[float, float, float]:
    """Transform a point that is stored in a row from the column ``at`` on by the link's frame."""
    a, b, c = source[row, at], source[row, at + 1], source[row, at + 2]
    return (
        work[FRAME] * a + work[FRAME + 1] * b + work[FRAME + 2] * c + work[FRAME + 3],
        work[FRAME + 4] * a + work[FRAME + 5] * b + work[FRAME + 6] * c + work[FRAME + 7],
        work[FRAME + 8] * a + work[FRAME + 9] * b + work[FRAME + 10] * c + work[FRAME + 11],
    )


@no_refcount
def enter(
    packed: PackedPathway, ball: Array, node: int, near: int, first: int, last: int, work: Array, level: int
) -> None:
    """Bound the deviations of the 16 children of a node; stored in ``work`` with the node and its segments."""
    rows, at, radius = packed.rows, LEVEL + STEP * level, ball[node, WHOLE + 3]
    x, y, z = moved(ball, node, WHOLE, work)
    j, low, high = span(rows, x, y, z, radius, near, first, last)
    put_places(ball, node, work)
    for k in range(at, at + 16):
        work[k] = 0.0
    for i in range(low, high + 1):
        raise_bounds(ball, node, rows, i, work, at)
    if low == first and ahead(rows, first, 0, x, y, z) < radius:
        raise_ends(ball, node, rows, first, 0, work, at)
    if high + 1 == last and ahead(rows, last - 1, 1, x, y, z) > -radius:
        raise_ends(ball, node, rows, last - 1, 1, work, at)
    work[at + NODE], work[at + HERE], work[at + LOW], work[at + HIGH] = float(node), float(j), float(low), float(high)


@no_refcount
def lower(packed: PackedPathway, j: int, work: Array) -> float:
    """Reduce the 16 points' deviations to those from segment ``j``; return the largest, in mm."""
    if packed.polar.shape[1] == 1:
        put_circles(packed.rows, j, work)
    else:
        put_radii(packed.rows, packed.polar, j, work)
    lower_gaps(packed.rows, j, work)
    largest: float = np.sqrt(most(work, GAP))
    return largest


@no_refcount
def measure(
    packed: PackedPathway, lanes: Array, block: int, near: int, first: int, last: int, least: float, work: Array
) -> float:
    """Largest δ_i of eq. 8 of a block's vertices in mm; if it exceeds ``least``, ``work`` has all of them.

    Segments are tested from the block's own outwards. The wall of one that lies ahead of the block is no nearer than
    the plane at which it begins.
    """
    rows, radius = packed.rows, lanes[block, 51]
    x, y, z = moved(lanes, block, 48, work)
    here, low, high = span(rows, x, y, z, radius, near, first, last)
    put_places(lanes, block, work)
    for k in range(16):
        work[GAP + k], work[AT + k] = np.inf, float(first)
    far = lower(packed, here, work)
    for j in range(here + 1, high + 1):
        if far > least:
            far = lower(packed, j, work)
    for j in range(here - 1, low - 1, -1):
        if far > least:
            far = lower(packed, j, work)
    for j in range(high + 1, last):
        near_plane = -ahead(rows, j, 0, x, y, z) < far + radius + rows[j, 56]
        if far > least and near_plane and may_reach(rows, j, x, y, z, far + radius):
            far = lower(packed, j, work)
    for j in range(low - 1, first - 1, -1):
        near_plane = ahead(rows, j, 1, x, y, z) < far + radius + rows[j, 57]
        if far > least and near_plane and may_reach(rows, j, x, y, z, far + radius):
            far = lower(packed, j, work)
    return far


@no_refcount
def may_reach(rows: Array, j: int, x: float, y: float, z: float, far: float) -> bool:
    """Whether the ball around a segment is nearer than ``far`` in mm."""
    u, v, w = rows[j, 14] - x, rows[j, 15] - y, rows[j, 16] - z
    reach: float = far + rows[j, 17]
    return bool(u * u + v * v + w * w < reach * reach)


@no_refcount
def every_of_block(
    packed: PackedPathway, lanes: Array, block: int, near: int, first: int, last: int, work: Array
) -> int:
    """Write δ_i in mm and segments of a block's vertices into ``work``; return the segment in which it lies.

    A ball below the lines of all segments that it can intersect is inside.
    """
    rows, radius = packed.rows, lanes[block, 51]
    x, y, z = moved(lanes, block, 48, work)
    j, low, high = span(rows, x, y, z, radius, near, first, last)
    inside = ahead(rows, low, 0, x, y, z) >= radius and ahead(rows, high, 1, x, y, z) <= -radius
    for i in range(low, high + 1):
        px, py, pz = x - rows[i, 0], y - rows[i, 1], z - rows[i, 2]
        t = px * rows[i, 19] + py * rows[i, 20] + pz * rows[i, 21]
        h = np.sqrt(max(px * px + py * py + pz * pz - t * t, 0.0)) + 1e-6
        inside = inside and h + radius * rows[i, 39] <= rows[i, 36] + rows[i, 37] * t
    if not inside:
        measure(packed, lanes, block, j, first, last, 0.0, work)
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


@no_refcount
def deepest(
    packed: PackedPathway, blocks: VertexBlocks, link: int, near: int, first: int, last: int, least: float, once: bool,
    work: Array,
) -> tuple[float, int, int, int]:  # fmt: skip
    """Largest δ_i of a link above ``least``, with its block, lane and segment; block -1 if there is none.

    With ``once`` any one above it. Nodes and blocks are visited in the order of their bounds.
    """
    block, lane, segment = -1, 0, near
    level = 0
    enter(packed, blocks.ball, link, near, first, last, work, 0)
    while level >= 0:
        at = LEVEL + STEP * level
        bound = most(work, at)
        if not bound > least:
            level -= 1
            continue
        k = 0
        while work[at + k] < bound:
            k += 1
        child, j = int(blocks.ball[int(work[at + NODE]), CHILD + k]), int(work[at + HERE])
        work[at + k] = 0.0
        if child >= 0:
            level += 1
            enter(packed, blocks.ball, child, j, first, last, work, level)
            continue
        far = measure(packed, blocks.lanes, -1 - child, j, first, last, least, work)
        if far > least:
            least, block, lane = far, -1 - child, 0
            squared = most(work, GAP)
            while work[GAP + lane] < squared:
                lane += 1
            segment = int(work[AT + lane])
            if once:
                break
    return least, block, lane, segment


@no_refcount
def take_frame(frames: Array, row: int, work: Array) -> bool:
    """Copy a frame into ``work``; return whether it is finite."""
    size = 0.0
    for i in range(3):
        for k in range(4):
            work[FRAME + 4 * i + k] = frames[row, i, k]
            size += abs(frames[row, i, k])
    return size < FARTHEST


@no_refcount
def containing(packed: PackedPathway, lanes: Array, block: int, near: int, first: int, last: int, work: Array) -> int:
    """Return a segment that contains the first vertex of a block; one exists."""
    put_places(lanes, block, work)
    x, y, z = work[0], work[16], work[32]
    _, low, high = span(packed.rows, x, y, z, 1e-6, near, first, last)
    while low < high and section_distance(x, y, z, packed.rows, packed.polar, low)[0] > 0.0:
        low += 1
    return low
