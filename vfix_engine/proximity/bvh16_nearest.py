"""Nearest-triangle queries of the 16-wide bounding volume hierarchy, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Float32Array, Int32Array, UInt64Array
from ..kernels.compiled import compiled, inlined, no_refcount
from .block_kernels import CORNERS, LANES, QUERY, WORK, block_gaps
from .box_simd import FACETS, NODE, PROBE, box_gaps, facet_bounds
from .bvh16_search import (
    GATHERED,
    NAMES,
    NEAREST,
    NUMBERS,
    PLACES,
    REMAINING,
    SINGLES,
    STACK,
    WORKSPACE,
    children,
    describe_segment,
    gather,
    push_within,
    rows_of,
    tool_of,
    tree_views_compiled,
    workspace_of,
)  # fmt: skip
from .candidate_kernels import append_block, nearest_of_block

ROW = 11  # numbers of a pair's row and labels


@no_refcount
def _nearest(
    boxes: Float32Array, corners: Array, label: Int32Array, facets: Int32Array, level: Int32Array, bound: float,
    seed: int, numbers: Array, singles: Float32Array, places: Int32Array,
) -> tuple[float, int]:  # fmt: skip
    """Nearest triangle to the segment in the workspace: (distance from its axis, place); (bound, −1) if none is nearer.

    ``seed``: a block that is likely to hold the triangle, or −1. A place is 16 · block + lane.
    The facets bound the distance from both sides; exact distances are computed for the few remaining blocks.
    """
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    bounds, lows = singles[PROBE + LANES : SINGLES - REMAINING], singles[SINGLES - REMAINING : SINGLES]
    waiting, left = places[:STACK], places[STACK:PLACES]
    blocks, count, far = level[1], 0, probe[9] == np.inf
    best, where, most = bound, -1, np.float32(bound) + probe[9]
    if seed >= 0 and not far:
        most = min(most, facet_bounds(facets[FACETS * seed : FACETS * (seed + 1)], probe)[1])
    top = 1
    waiting[0], bounds[0] = level[len(level) - 1] - 1, np.float32(-np.inf)
    while top > 0:
        top -= 1
        node = waiting[top]
        if bounds[top] > most:
            continue
        if count + LANES > REMAINING:
            best, where = _measure(
                corners, label, facets, left, lows, count, most, best, where, numbers, singles, places
            )
            count, most = 0, min(most, np.float32(best) + probe[9])
        box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
        first, last = children(node, level)
        if first >= blocks:
            top = _push(first, last, gaps, most, waiting, bounds, top)
            continue
        for block in range(first, last):
            low = gaps[block - first]
            if not low > most:
                if not far:
                    low, high = facet_bounds(facets[FACETS * block : FACETS * (block + 1)], probe)
                    most = min(most, high)
                left[count], lows[count] = block, low
                count += int(not low > most)
    best, where = _measure(corners, label, facets, left, lows, count, most, best, where, numbers, singles, places)
    if where >= 0:
        while label[where] < 0:  # unused lanes repeat the last triangle
            where -= 1
    return best, where


@no_refcount
def _measure(
    corners: Array, label: Int32Array, facets: Int32Array, left: Int32Array, lows: Float32Array, count: int,
    most: np.float32, best: float, where: int, numbers: Array, singles: Float32Array, places: Int32Array,
) -> tuple[float, int]:  # fmt: skip
    """Exact distances of the remaining triangles that may be nearer than ``most``."""
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    gathered, names, chosen = places[GATHERED:PLACES], places[NAMES:GATHERED], 0
    block, work = numbers[NUMBERS - CORNERS : NUMBERS], numbers[QUERY : QUERY + WORK]
    for i in range(count):
        if not lows[i] > most:
            here = left[i]
            after = push_within(facets, here, probe, float(most), gaps, gathered, chosen)
            if after < 0:
                own = corners[CORNERS * here : CORNERS * (here + 1)]
                best, lane = nearest_of_block(own, numbers[:QUERY], best, work)
                if lane >= 0:
                    _store_nearest(work, lane, numbers)
                    where = LANES * here + lane
                    most = min(most, np.float32(best) + probe[9])
            else:
                chosen = after
        while chosen >= LANES or (chosen > 0 and i == count - 1):
            last = chosen - 1
            chosen = gather(corners, label, gathered, chosen, block, names)
            best, lane = nearest_of_block(block, numbers[:QUERY], best, work)
            if lane >= 0:
                _store_nearest(work, lane, numbers)
                where = gathered[min(chosen + lane, last)]
                most = min(most, np.float32(best) + probe[9])
    return best, where


@no_refcount
def _push(
    first: int, last: int, gaps: Float32Array, most: np.float32, waiting: Int32Array, bounds: Float32Array, top: int
) -> int:
    """Push the children within ``most`` onto the stack, the nearest last; return the new top."""
    best = top
    for child in range(first, last):
        gap = gaps[child - first]
        waiting[top], bounds[top] = child, gap
        if gap < bounds[best]:
            best = top
        top += int(not gap > most)
    if best < top:
        waiting[best], waiting[top - 1] = waiting[top - 1], waiting[best]
        bounds[best], bounds[top - 1] = bounds[top - 1], bounds[best]
    return top


@no_refcount
def _clearance(store: Array, tool: Array, upper: float, workspace: Array) -> tuple[float, int, int]:
    """Smallest distance of the tool's surface, its segment and place; (upper, −1, −1) when none is nearer."""
    frame, level, corners, facets, boxes, label = tree_views_compiled(store)
    start, end, radius = tool_of(tool)
    numbers, singles, places, _ = workspace_of(workspace)
    least, segment, where = upper, -1, -1
    for s in range(len(radius)):
        if least + radius[s] > 0.0:
            describe_segment(start[s], end[s], frame, numbers, singles)
            gap, place = _nearest(
                boxes, corners, label, facets, level, least + radius[s], -1, numbers, singles, places
            )  # fmt: skip
            if place >= 0:
                least, segment, where = gap - radius[s], s, place
    return least, segment, where


@compiled
def bvh16_clearance(store: Array, tool: Array, upper: float) -> float:
    """Smallest distance of the tool's surface, or ``upper`` when nothing is nearer."""
    return _clearance(store, tool, upper, np.empty(WORKSPACE))[0]


@no_refcount
def _store_nearest(work: Array, lane: int, numbers: Array) -> None:
    for k in range(4):
        numbers[NEAREST + k] = work[LANES * (1 + k) + lane]


@compiled
def bvh16_closest(store: Array, tool: Array) -> tuple[tuple[float, ...], int, int]:
    """The row of the pair with the smallest distance as ten numbers (see ``pair_from_row``), its segment and triangle.

    As numbers, since handing over an array took a sixth of the whole query.
    """
    space = np.empty(WORKSPACE + ROW)
    row = space[WORKSPACE:]
    segment, triangle = _closest(store, tool, row, space[:WORKSPACE])
    return (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9]), segment, triangle


@no_refcount
def _closest(store: Array, tool: Array, buffer: Array, workspace: Array) -> tuple[int, int]:
    frame, _, corners, _, _, label = tree_views_compiled(store)
    start, end, radius = tool_of(tool)
    numbers, singles, places, lanes = workspace_of(workspace)
    _, s, place = _clearance(store, tool, np.inf, workspace)
    if not _nearest_row(start[s], end[s], radius[s], numbers, buffer):
        rows, labels = rows_of(buffer)
        _one_row(
            corners, label, place, start[s], end[s], radius[s], frame, rows, labels, numbers, singles, places, lanes
        )
    return s, label[place]


@inlined
def _nearest_row(start: Array, end: Array, radius: float, numbers: Array, row: Array) -> bool:
    """Write the row of the stored points; False where they coincide and the triangle has to give the normal."""
    t, size = numbers[NEAREST], 0.0
    for k in range(3):
        row[4 + k] = start[k] + t * (end[k] - start[k])
        row[7 + k] = start[k] + numbers[NEAREST + 1 + k]
        row[1 + k] = t * (end[k] - start[k]) - numbers[NEAREST + 1 + k]
        size += row[1 + k] * row[1 + k]
    distance = np.sqrt(size)
    row[0] = distance - radius
    if distance < 1e-9:
        return False
    row[1], row[2], row[3] = row[1] / distance, row[2] / distance, row[3] / distance
    return True


@inlined
def _one_row(
    corners: Array, label: Int32Array, place: int, start: Array, end: Array, radius: float, frame: Array,
    rows: Array, labels: Int32Array, numbers: Array, singles: Float32Array, places: Int32Array, lanes: UInt64Array,
) -> None:  # fmt: skip
    """The row of one segment and the triangle at one place."""
    block, alone = place // LANES, places[:LANES]
    describe_segment(start, end, frame, numbers, singles)
    alone[:] = -1
    alone[place % LANES] = label[place]
    append_block(
        corners[CORNERS * block : CORNERS * (block + 1)], alone,
        numbers[:QUERY], radius, np.inf, 0, numbers[QUERY : QUERY + WORK], lanes, rows, labels, 0, np.inf,
    )  # fmt: skip


@compiled
def bvh16_points(store: Array, points: Array) -> tuple[Array, Array, Int32Array]:
    """Distance (n,), closest point (n, 3) and triangle (n,) of each point (n, 3)."""
    distance, closest, triangle = np.empty(len(points)), np.empty(points.shape), np.empty(len(points), np.int32)
    _points(store, points, distance, closest, triangle, np.empty(WORKSPACE))
    return distance, closest, triangle


@no_refcount
def _points(
    store: Array, points: Array, distance: Array, closest: Array, triangle: Int32Array, workspace: Array
) -> None:
    frame, level, corners, facets, boxes, label = tree_views_compiled(store)
    numbers, singles, places, _ = workspace_of(workspace)
    query, work = numbers[:QUERY], numbers[QUERY : QUERY + WORK]
    block = -1  # the previous block is a good guess for successive points
    for i in range(len(points)):
        describe_segment(points[i], points[i], frame, numbers, singles)
        distance[i], place = _nearest(boxes, corners, label, facets, level, np.inf, block, numbers, singles, places)
        block = place // LANES
        block_gaps(corners[CORNERS * block : CORNERS * (block + 1)], query, np.inf, work)
        for k in range(3):
            closest[i, k] = points[i, k] + work[LANES * (2 + k) + place % LANES]
        triangle[i] = label[place]
