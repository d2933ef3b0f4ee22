"""Searching the wide box tree, compiled: down 16 boxes at a time to blocks of 16 triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY, WORK, block_gaps, describe
from .box_lanes import NODE, PROBE, box_gaps, describe_single
from .candidate_kernels import append_block, nearest_of_block
from .compiled import compiled
from .rows_kernel import widened
from .tree_query import group_row, node_gap

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]

STACK = 16 * 10  # room for a descent: at most 16 entries wait on each level of an index of 32 bits


@compiled
def wide_pairs(
    boxes: Single, corners: Array, label: Index, frame: Array, level: Index, axes: Array, slab: Array,
    start: Array, end: Array, radius: Array, threshold: float, flat: float, exact_within: float,
) -> tuple[Array, Index]:  # fmt: skip
    """All pairs with distance − radius ≤ threshold as rows (see ``pairs_from_rows``).

    Blocks and nodes that are no thicker than ``flat`` and farther than ``exact_within`` yield one pair on their box.
    """
    rows, labels = np.empty((256, 10)), np.empty((256, 2), np.int32)
    query, work, lp, ld = np.empty(QUERY), np.empty(WORK), np.empty(3), np.empty(3)
    probe, gaps = np.empty(PROBE, np.float32), np.empty(LANES, np.float32)
    waiting = np.empty(STACK, np.int32)
    found, blocks = 0, level[1]
    for s in range(len(radius)):
        p, d = start[s], end[s] - start[s]
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        describe(p, d, query)
        describe_single(p, d, frame, probe)
        top = 1
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top]
            box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
            first, last = children(node, level)
            for child in range(first, last):
                if gaps[child - first] > limit:
                    continue
                if found + LANES > len(rows):
                    rows, labels = widened(rows, labels)
                if slab[child, 1, 2] - slab[child, 0, 2] <= flat:
                    gap, t = node_gap(axes[child], slab[child], p, d, lp, ld)
                    if gap > limit * limit:
                        continue
                    if gap > 0.0 and np.sqrt(gap) - radius[s] > exact_within:
                        group_row(
                            axes[child], slab[child], lp, ld, t, gap, s, p, d, radius[s], rows[found], labels[found]
                        )
                        found += 1
                        continue
                if child >= blocks:
                    waiting[top] = child
                    top += 1
                else:
                    found, _ = append_block(
                        corners[CORNERS * child : CORNERS * (child + 1)], label[LANES * child : LANES * (child + 1)],
                        query, radius[s], limit, s, work, rows, labels, found, 0.0,
                    )  # fmt: skip
    return rows[:found].copy(), labels[:found].copy()


@compiled
def children(node: int, level: Index) -> tuple[int, int]:
    """The first child of a node and the one behind its last; blocks are numbered from 0, nodes behind them."""
    deep = 1
    while node >= level[deep + 1]:
        deep += 1
    first = level[deep - 1] + LANES * (node - level[deep])
    return first, min(first + LANES, level[deep])


@compiled
def wide_nearest(
    boxes: Single, corners: Array, label: Index, frame: Array, level: Index,
    query: Array, probe: Single, bound: float, seed: int, work: Array,
) -> tuple[float, int]:  # fmt: skip
    """Nearest triangle to one segment: (distance from its axis, place); (bound, −1) when none is nearer than bound.

    ``seed``: a block that is likely to hold it, or −1. A place is 16 · block + lane.
    """
    gaps, waiting, bounds = np.empty(LANES, np.float32), np.empty(STACK, np.int32), np.empty(STACK, np.float32)
    blocks = level[1]
    best, where = bound, -1
    if seed >= 0:
        best, lane = nearest_of_block(corners[CORNERS * seed : CORNERS * (seed + 1)], query, best, work)
        if lane >= 0:
            where = LANES * seed + lane
    top = 1
    waiting[0], bounds[0] = level[len(level) - 1] - 1, np.float32(-np.inf)
    while top > 0:
        top -= 1
        node = waiting[top]
        if bounds[top] > best:
            continue
        if node < blocks:
            best, lane = nearest_of_block(corners[CORNERS * node : CORNERS * (node + 1)], query, best, work)
            if lane >= 0:
                where = LANES * node + lane
            continue
        box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
        first, last = children(node, level)
        bottom = top
        for child in range(first, last):
            gap = gaps[child - first]
            if gap > best:
                continue
            # Sorted, the nearest on top and searched first, so that the bound shrinks early.
            place = top
            while place > bottom and bounds[place - 1] < gap:
                waiting[place], bounds[place] = waiting[place - 1], bounds[place - 1]
                place -= 1
            waiting[place], bounds[place] = child, gap
            top += 1
    if where >= 0:
        where = min(where, _last_place(label))
    return best, where


@compiled
def _last_place(label: Index) -> int:
    """The last lane with a triangle; the lanes behind it repeat it."""
    place = len(label) - 1
    while label[place] < 0:
        place -= 1
    return place


@compiled
def wide_clearance(
    boxes: Single, corners: Array, label: Index, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, upper: float,
) -> tuple[float, int, int]:  # fmt: skip
    """Smallest distance of the tool's surface, its segment and place; (upper, −1, −1) when none is nearer."""
    query, work, probe = np.empty(QUERY), np.empty(WORK), np.empty(PROBE, np.float32)
    least, segment, where = upper, -1, -1
    for s in range(len(radius)):
        if least + radius[s] <= 0.0:
            continue
        describe(start[s], end[s] - start[s], query)
        describe_single(start[s], end[s] - start[s], frame, probe)
        gap, place = wide_nearest(boxes, corners, label, frame, level, query, probe, least + radius[s], -1, work)
        if place >= 0:
            least, segment, where = gap - radius[s], s, place
    return least, segment, where


@compiled
def wide_points(
    boxes: Single, corners: Array, label: Index, frame: Array, level: Index, points: Array
) -> tuple[Array, Array, Index]:
    """Distance (n,), closest point (n, 3) and triangle (n,) of each point (n, 3)."""
    count = len(points)
    distance, closest, triangle = np.empty(count), np.empty((count, 3)), np.empty(count, np.int32)
    query, work, probe, still = np.empty(QUERY), np.empty(WORK), np.empty(PROBE, np.float32), np.zeros(3)
    seed = -1
    for i in range(count):
        describe(points[i], still, query)
        describe_single(points[i], still, frame, probe)
        distance[i], place = wide_nearest(boxes, corners, label, frame, level, query, probe, np.inf, seed, work)
        seed = place // LANES
        block_gaps(corners[CORNERS * seed : CORNERS * (seed + 1)], query, np.inf, work)
        for k in range(3):
            closest[i, k] = points[i, k] + work[32 + LANES * k + place % LANES]
        triangle[i] = label[place]
    return distance, closest, triangle


@compiled
def wide_places(
    boxes: Single, corners: Array, label: Index, frame: Array, level: Index, p: Array, d: Array, limit: float
) -> Index:
    """Places of all triangles within ``limit`` of one axis segment p + t·d."""
    places = np.empty(1024, np.int32)
    query, work = np.empty(QUERY), np.empty(WORK)
    probe, gaps = np.empty(PROBE, np.float32), np.empty(LANES, np.float32)
    waiting = np.empty(STACK, np.int32)
    found, blocks = 0, level[1]
    describe(p, d, query)
    describe_single(p, d, frame, probe)
    top = 1
    waiting[0] = level[len(level) - 1] - 1
    while top > 0:
        top -= 1
        node = waiting[top]
        box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
        first, last = children(node, level)
        for child in range(first, last):
            if gaps[child - first] > limit:
                continue
            if child >= blocks:
                waiting[top] = child
                top += 1
                continue
            if found + LANES > len(places):
                wider = np.empty(2 * len(places), np.int32)
                wider[:found] = places[:found]
                places = wider
            block_gaps(corners[CORNERS * child : CORNERS * (child + 1)], query, limit, work)
            for j in range(LANES):
                places[found] = LANES * child + j
                found += int((work[j] <= limit * limit) & (label[LANES * child + j] >= 0))
    return places[:found].copy()


@compiled
def corners_at(corners: Array, places: Index) -> Array:
    """Corners (n, 9) of the triangles at some places."""
    picked = np.empty((len(places), 9))
    for i in range(len(places)):
        at = CORNERS * (places[i] // LANES) + places[i] % LANES
        for k in range(9):
            picked[i, k] = corners[at + LANES * k]
    return picked
