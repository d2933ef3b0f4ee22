"""Searching the wide box tree, compiled: down 16 boxes at a time to blocks of 16 triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY, WORK, block_gaps, describe
from .box_lanes import BALLS, NODE, PROBE, SHELL, balls_out_of_reach, box_gaps, describe_single, shell_gaps
from .candidate_kernels import append_block, nearest_of_block
from .compiled import compiled
from .rows_kernel import widened

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]

STACK = 16 * 10  # room for a descent: at most 16 entries wait on each level of an index of 32 bits


@compiled
def children(node: int, level: Index) -> tuple[int, int]:
    """The first child of a node and the one behind its last; blocks are numbered from 0, nodes behind them."""
    deep = 1
    while node >= level[deep + 1]:
        deep += 1
    first = level[deep - 1] + LANES * (node - level[deep])
    return first, min(first + LANES, level[deep])


@compiled
def _near_blocks(
    boxes: Single, balls: Single, level: Index, probe: Single, limit: float, gaps: Single, near: Index
) -> tuple[Index, int]:
    """Blocks that may hold a triangle within ``limit`` of the axis, in ``near`` or a longer one, and how many."""
    waiting = np.empty(STACK, np.int32)
    found, blocks, top = 0, level[1], 1
    waiting[0] = level[len(level) - 1] - 1
    reach = np.float32(limit)
    while top > 0:
        top -= 1
        node = waiting[top]
        box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
        first, last = children(node, level)
        if first >= blocks:
            for child in range(first, last):
                waiting[top] = child
                top += int(not gaps[child - first] > limit)
            continue
        if found + LANES >= len(near):
            longer = np.empty(2 * len(near), np.int32)
            longer[:found] = near[:found]
            near = longer
        before = found
        for child in range(first, last):
            near[found] = child
            found += int(not gaps[child - first] > limit)
        kept = before
        for i in range(before, found):
            block = near[i]
            near[kept] = block
            kept += int(balls_out_of_reach(balls[BALLS * block : BALLS * (block + 1)], probe, reach) < LANES)
        found = kept
    return near, found


@compiled
def wide_pairs(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, threshold: float,
) -> tuple[Array, Index]:  # fmt: skip
    """All pairs with distance − radius ≤ threshold as rows (see ``pairs_from_rows``)."""
    rows, labels = np.empty((512, 10)), np.empty((512, 2), np.int32)
    query, work, lanes = np.empty(QUERY), np.empty(WORK), np.empty(LANES + 1, np.uint64)
    probe, gaps, near = np.empty(PROBE, np.float32), np.empty(LANES, np.float32), np.empty(512, np.int32)
    found, flat = 0, rows.reshape(-1)
    for s in range(len(radius)):
        p, d = start[s], end[s] - start[s]
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        describe(p, d, query)
        describe_single(p, d, frame, probe)
        near, count = _near_blocks(boxes, balls, level, probe, limit, gaps, near)
        for i in range(count):
            if found + LANES > len(rows):
                rows, labels = widened(rows, labels)
                flat = rows.reshape(-1)
            block = near[i]
            found, _ = append_block(
                corners[CORNERS * block : CORNERS * (block + 1)], label[LANES * block : LANES * (block + 1)],
                query, radius[s], limit, s, work, lanes, flat, labels, found, 0.0,
            )  # fmt: skip
    return rows[:found], labels[:found]


@compiled
def wide_groups(
    boxes: Single, corners: Array, label: Index, shells: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, threshold: float, flat: float, exact_within: float,
) -> tuple[Array, Index]:  # fmt: skip
    """As ``wide_pairs``, but with one pair for all of a block or node that lies flat before the segment.

    That is where its box is no deeper than ``flat`` towards the segment and farther than ``exact_within``; the pair is
    the segment's and the plane's in front of that box.
    """
    rows, labels = np.empty((256, 10)), np.empty((256, 2), np.int32)
    query, work, lanes = np.empty(QUERY), np.empty(WORK), np.empty(LANES + 1, np.uint64)
    probe, gaps, depths = np.empty(PROBE, np.float32), np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    also, waiting = np.empty(LANES, np.float32), np.empty(STACK, np.int32)
    found, blocks = 0, level[1]
    for s in range(len(radius)):
        p, d = start[s], end[s] - start[s]
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        exact = max(exact_within, -radius[s]) + radius[s]
        describe(p, d, query)
        describe_single(p, d, frame, probe)
        top = 1
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top] - blocks
            box_gaps(boxes[NODE * node : NODE * (node + 1)], probe, gaps)
            shell = shells[SHELL * node : SHELL * (node + 1)]
            shell_gaps(shell, probe, also, depths)
            first, last = children(node + blocks, level)
            for child in range(first, last):
                lane = child - first
                if gaps[lane] > limit or also[lane] > limit:
                    continue
                if found + LANES > len(rows):
                    rows, labels = widened(rows, labels)
                if depths[lane] <= flat and also[lane] > exact:
                    _group_row(shell, lane, query, frame, radius[s], also[lane], rows[found])
                    labels[found, 0], labels[found, 1] = s, -1
                    found += 1
                elif child >= blocks:
                    waiting[top] = child
                    top += 1
                else:
                    found, _ = append_block(
                        corners[CORNERS * child : CORNERS * (child + 1)], label[LANES * child : LANES * (child + 1)],
                        query, radius[s], limit, s, work, lanes, rows.reshape(-1), labels, found, 0.0,
                    )  # fmt: skip
    return rows[:found], labels[:found]


@compiled
def _group_row(shell: Single, lane: int, query: Array, frame: Array, radius: float, gap: float, row: Array) -> None:
    """The pair of the segment's point nearest to a box's centre and the plane ``gap`` mm from it, before the box."""
    t, size = query[15], 0.0
    for k in range(3):
        row[7 + k] = shell[LANES * k + lane] + frame[k] - query[k]
        t += row[7 + k] * query[12 + k]
    t = min(max(t, 0.0), 1.0)
    for k in range(3):
        row[1 + k] = t * query[3 + k] - row[7 + k]
        size += row[1 + k] * row[1 + k]
    size = np.sqrt(size)
    row[0] = gap - radius
    for k in range(3):
        row[1 + k] /= size
        row[4 + k] = query[k] + t * query[3 + k]
        row[7 + k] = row[4 + k] - gap * row[1 + k]


@compiled
def wide_nearest(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
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
            if balls_out_of_reach(balls[BALLS * node : BALLS * (node + 1)], probe, np.float32(best)) == LANES:
                continue
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
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
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
        gap, place = wide_nearest(boxes, corners, label, balls, frame, level, query, probe, least + radius[s], -1, work)
        if place >= 0:
            least, segment, where = gap - radius[s], s, place
    return least, segment, where


@compiled
def wide_closest(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array,
) -> tuple[Array, int, int]:  # fmt: skip
    """The row of the pair with the smallest distance, its segment and its triangle."""
    _, s, place = wide_clearance(boxes, corners, label, balls, frame, level, start, end, radius, np.inf)
    query, work, lanes = np.empty(QUERY), np.empty(WORK), np.empty(LANES + 1, np.uint64)
    rows, labels = np.empty(10), np.empty((1, 2), np.int32)
    block = place // LANES
    describe(start[s], end[s] - start[s], query)
    alone = np.full(LANES, -1, np.int32)
    alone[place % LANES] = label[place]
    append_block(
        corners[CORNERS * block : CORNERS * (block + 1)], alone,
        query, radius[s], np.inf, s, work, lanes, rows, labels, 0, 0.0,
    )  # fmt: skip
    return rows, s, label[place]


@compiled
def wide_points(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index, points: Array
) -> tuple[Array, Array, Index]:
    """Distance (n,), closest point (n, 3) and triangle (n,) of each point (n, 3)."""
    count = len(points)
    distance, closest, triangle = np.empty(count), np.empty((count, 3)), np.empty(count, np.int32)
    query, work, probe, still = np.empty(QUERY), np.empty(WORK), np.empty(PROBE, np.float32), np.zeros(3)
    seed = -1
    for i in range(count):
        describe(points[i], still, query)
        describe_single(points[i], still, frame, probe)
        distance[i], place = wide_nearest(boxes, corners, label, balls, frame, level, query, probe, np.inf, seed, work)
        seed = place // LANES
        block_gaps(corners[CORNERS * seed : CORNERS * (seed + 1)], query, np.inf, work)
        for k in range(3):
            closest[i, k] = points[i, k] + work[32 + LANES * k + place % LANES]
        triangle[i] = label[place]
    return distance, closest, triangle


@compiled
def wide_places(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    p: Array, d: Array, limit: float,
) -> Index:  # fmt: skip
    """Places of all triangles within ``limit`` of one axis segment p + t·d."""
    query, work = np.empty(QUERY), np.empty(WORK)
    probe, gaps = np.empty(PROBE, np.float32), np.empty(LANES, np.float32)
    describe(p, d, query)
    describe_single(p, d, frame, probe)
    near, count = _near_blocks(boxes, balls, level, probe, limit, gaps, np.empty(512, np.int32))
    places, found = np.empty(LANES * count + 1, np.int32), 0
    for i in range(count):
        block = near[i]
        block_gaps(corners[CORNERS * block : CORNERS * (block + 1)], query, limit, work)
        for j in range(LANES):
            places[found] = LANES * block + j
            found += int((work[j] <= limit * limit) & (label[LANES * block + j] >= 0))
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
