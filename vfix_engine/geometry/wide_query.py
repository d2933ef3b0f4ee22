"""Searching the wide box tree, compiled: down 16 boxes at a time to blocks of 16 triangles.

Each query is a shell that makes room and a part that searches; the latter makes no array (``compiled.borrowing``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY, WORK, block_gaps, describe
from .box_lanes import (
    BALLS,
    NODE,
    PROBE,
    SHELL,
    ball_bounds,
    ball_gaps,
    box_gaps,
    describe_single,
    shell_gaps,
)  # fmt: skip
from .candidate_kernels import append_block, nearest_of_block
from .compiled import borrowing, compiled

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]
Lanes = NDArray[np.uint64]

STACK = 16 * 10  # room for a descent: at most 16 entries wait on each level of an index of 32 bits
LEFT = 256  # blocks that are kept for a look at their exact distances

# Room that a query calculates in: float64, float32 and int32.
NUMBERS = QUERY + WORK + 3 + CORNERS
SINGLES = PROBE + LANES + STACK + LEFT
NAMES = STACK + LEFT
PICKED = NAMES + LANES
PLACES = PICKED + 2 * LANES


@borrowing
def _set_out(start: Array, end: Array, frame: Array, numbers: Array, singles: Single) -> None:
    """Describe the segment from ``start`` to ``end`` (3,) in the room of a query."""
    d = numbers[QUERY + WORK : QUERY + WORK + 3]
    for k in range(3):
        d[k] = end[k] - start[k]
    describe(start, d, numbers[:QUERY])
    describe_single(start, d, frame, singles[:PROBE])


@borrowing
def _children(node: int, level: Index) -> tuple[int, int]:
    """The first child of a node and the one behind its last; blocks are numbered from 0, nodes behind them."""
    deep = 1
    while node >= level[deep + 1]:
        deep += 1
    first = level[deep - 1] + LANES * (node - level[deep])
    return first, min(first + LANES, level[deep])


@borrowing
def _near(first: int, last: int, gaps: Single, limit: float, places: Index, top: int) -> int:
    """Those of the children first … last − 1 that may be within ``limit``, from places[top] on; the place behind."""
    for child in range(first, last):
        places[top] = child
        top += int(not gaps[child - first] > limit)
    return top


@borrowing
def _in_reach(balls: Single, block: int, probe: Single, limit: float, gaps: Single, picked: Index, count: int) -> int:
    """Places of a block's triangles that may be within ``limit``, from picked[count] on; the place behind."""
    ball_gaps(balls[BALLS * block : BALLS * (block + 1)], probe, gaps)
    for j in range(LANES):
        picked[count] = LANES * block + j
        count += int(not gaps[j] > limit)
    return count


@borrowing
def _pick(corners: Array, label: Index, picked: Index, count: int, block: Array, names: Index) -> int:
    """The last at most 16 of ``count`` picked triangles into a block of their own; how many are left."""
    first = max(count - LANES, 0)
    for j in range(LANES):
        place = picked[min(first + j, count - 1)]
        names[j] = label[place] if first + j < count else -1
        lane = corners[CORNERS * (place // LANES) + place % LANES : CORNERS * (place // LANES + 1)]
        for k in range(9):
            block[LANES * k + j] = lane[LANES * k]
    return first


@compiled
def wide_pairs(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, threshold: float, room: int,
) -> tuple[Array, Index]:  # fmt: skip
    """All pairs with distance − radius ≤ threshold as rows (see ``pairs_from_rows``); ``room`` rows are expected."""
    numbers, singles, places = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(PLACES, np.int32)
    lanes = np.empty(LANES + 1, np.uint64)
    while True:
        rows, labels = np.empty((room, 10)), np.empty((room, 2), np.int32)
        found = _pairs(
            boxes, corners, label, balls, frame, level, start, end, radius, threshold,
            rows, labels, numbers, singles, places, lanes,
        )  # fmt: skip
        if found <= room:
            return rows[:found], labels[:found]
        room = found


@borrowing
def _pairs(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, threshold: float,
    rows: Array, labels: Index, numbers: Array, singles: Single, places: Index, lanes: Lanes,
) -> int:  # fmt: skip
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    waiting, near, picked = places[:STACK], places[STACK : STACK + LANES], places[PICKED:PLACES]
    names = places[NAMES:PICKED]
    found, blocks = 0, level[1]
    for s in range(len(radius)):
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        _set_out(start[s], end[s], frame, numbers, singles)
        top, chosen = 1, 0
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top]
            box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
            first, last = _children(node, level)
            if first >= blocks:
                top = _near(first, last, gaps, limit, waiting, top)
                continue
            count = _near(first, last, gaps, limit, near, 0)
            for i in range(count):
                chosen = _in_reach(balls, near[i], probe, limit, gaps, picked, chosen)
                if chosen >= LANES:
                    chosen, found = _rows_of_picked(
                        corners, label, picked, chosen, radius[s], limit, s, rows, labels, found, numbers, names, lanes
                    )
        if chosen > 0:
            chosen, found = _rows_of_picked(
                corners, label, picked, chosen, radius[s], limit, s, rows, labels, found, numbers, names, lanes
            )
    return found


@borrowing
def _rows_of_picked(
    corners: Array, label: Index, picked: Index, count: int, radius: float, limit: float, segment: int,
    rows: Array, labels: Index, found: int, numbers: Array, names: Index, lanes: Lanes,
) -> tuple[int, int]:  # fmt: skip
    """The rows of the last at most 16 picked triangles: (how many are still picked, how many rows there are)."""
    block = numbers[NUMBERS - CORNERS : NUMBERS]
    count = _pick(corners, label, picked, count, block, names)
    found, _ = append_block(
        block, names, numbers[:QUERY], radius, limit, segment,
        numbers[QUERY : QUERY + WORK], lanes, rows, labels, found, np.inf,
    )  # fmt: skip
    return count, found


@compiled
def wide_groups(
    corners: Array, label: Index, balls: Single, shells: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, threshold: float, flat: float, exact_within: float, room: int,
) -> tuple[Array, Index]:  # fmt: skip
    """As ``wide_pairs``, but with one pair for all of a flat block or node that is not too near.

    That is where its box is no thicker than ``flat`` and farther than ``exact_within``; the pair is the segment's and
    the plane's that separates it from that box.
    """
    numbers, singles, places = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(PLACES, np.int32)
    lanes = np.empty(LANES + 1, np.uint64)
    while True:
        rows, labels = np.empty((room, 10)), np.empty((room, 2), np.int32)
        found = _groups(
            corners, label, balls, shells, frame, level, start, end, radius, threshold, flat, exact_within,
            rows, labels, numbers, singles, places, lanes,
        )  # fmt: skip
        if found <= room:
            return rows[:found], labels[:found]
        room = found


@borrowing
def _groups(
    corners: Array, label: Index, balls: Single, shells: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, threshold: float, flat: float, exact_within: float,
    rows: Array, labels: Index, numbers: Array, singles: Single, places: Index, lanes: Lanes,
) -> int:  # fmt: skip
    query, probe, gaps = numbers[:QUERY], singles[:PROBE], singles[PROBE : PROBE + LANES]
    waiting, near, picked = places[:STACK], places[STACK : STACK + LANES], places[PICKED:PLACES]
    names = places[NAMES:PICKED]
    found, blocks, thin = 0, level[1], np.float32(0.5 * flat)
    for s in range(len(radius)):
        limit, exact = threshold + radius[s], max(exact_within + radius[s], 0.0)
        if limit < 0.0:
            continue
        _set_out(start[s], end[s], frame, numbers, singles)
        top, chosen = 1, 0
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top]
            shell = shells[SHELL * (node - blocks) : SHELL * (node - blocks + 1)]
            shell_gaps(shell, probe, gaps)
            first, last = _children(node, level)
            count = 0
            for child in range(first, last):
                lane = child - first
                inside = not gaps[lane] > limit
                grouped = (gaps[lane] > exact) & (shell[14 * LANES + lane] <= thin)
                near[count] = child
                count += int(inside & (not grouped))
                if inside & grouped:
                    if found < len(labels):
                        _group_row(shell, lane, query, probe, frame, radius[s], rows[found])
                        labels[found, 0], labels[found, 1] = s, -1
                    found += 1
            if first >= blocks:
                for i in range(count):
                    waiting[top + i] = near[i]
                top += count
                continue
            for i in range(count):
                chosen = _in_reach(balls, near[i], probe, limit, gaps, picked, chosen)
                if chosen >= LANES:
                    chosen, found = _rows_of_picked(
                        corners, label, picked, chosen, radius[s], limit, s, rows, labels, found, numbers, names, lanes
                    )
        if chosen > 0:
            chosen, found = _rows_of_picked(
                corners, label, picked, chosen, radius[s], limit, s, rows, labels, found, numbers, names, lanes
            )
    return found


@borrowing
def _group_row(shell: Single, lane: int, query: Array, probe: Single, frame: Array, radius: float, row: Array) -> None:
    """The pair of the segment's point nearest to a box's centre and the plane across the way there, before the box."""
    x = shell[lane] + frame[0] - query[0]
    y = shell[LANES + lane] + frame[1] - query[1]
    z = shell[2 * LANES + lane] + frame[2] - query[2]
    t = min(max(query[15] + x * query[12] + y * query[13] + z * query[14], 0.0), 1.0)
    x, y, z = t * query[3] - x, t * query[4] - y, t * query[5] - z
    size = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    gap = size - probe[9]
    for i in range(3):
        along = x * shell[LANES * (3 + 3 * i) + lane]
        along += y * shell[LANES * (4 + 3 * i) + lane] + z * shell[LANES * (5 + 3 * i) + lane]
        gap -= abs(along) * shell[LANES * (12 + i) + lane]
    row[0], row[1], row[2], row[3] = gap - radius, x, y, z
    row[4], row[5], row[6] = query[0] + t * query[3], query[1] + t * query[4], query[2] + t * query[5]
    row[7], row[8], row[9] = row[4] - gap * x, row[5] - gap * y, row[6] - gap * z


@borrowing
def _nearest(
    boxes: Single, corners: Array, label: Index, balls: Single, level: Index, bound: float, seed: int,
    numbers: Array, singles: Single, places: Index,
) -> tuple[float, int]:  # fmt: skip
    """Nearest triangle to the segment set out: (distance from its axis, place); (bound, −1) when none is nearer.

    ``seed``: a block that is likely to hold it, or −1. A place is 16 · block + lane.
    The balls narrow the distance down; exact distances are only taken of the few blocks that are left.
    """
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    bounds, lows = singles[PROBE + LANES : SINGLES - LEFT], singles[SINGLES - LEFT : SINGLES]
    waiting, left = places[:STACK], places[STACK:PLACES]
    blocks, count, far = level[1], 0, probe[9] == np.inf
    best, where, most = bound, -1, np.float32(bound) + probe[9]
    if seed >= 0 and not far:
        most = min(most, ball_bounds(balls[BALLS * seed : BALLS * (seed + 1)], probe)[1])
    top = 1
    waiting[0], bounds[0] = level[len(level) - 1] - 1, np.float32(-np.inf)
    while top > 0:
        top -= 1
        node = waiting[top]
        if bounds[top] > most:
            continue
        if count + LANES > LEFT:
            best, where = _look(corners, label, balls, left, lows, count, most, best, where, numbers, singles, places)
            count, most = 0, min(most, np.float32(best) + probe[9])
        box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
        first, last = _children(node, level)
        if first >= blocks:
            top = _push(first, last, gaps, most, waiting, bounds, top)
            continue
        for block in range(first, last):
            low = gaps[block - first]
            if not low > most:
                if not far:
                    low, high = ball_bounds(balls[BALLS * block : BALLS * (block + 1)], probe)
                    most = min(most, high)
                left[count], lows[count] = block, low
                count += int(not low > most)
    best, where = _look(corners, label, balls, left, lows, count, most, best, where, numbers, singles, places)
    if where >= 0:
        while label[where] < 0:  # lanes that no triangle fills repeat the last one
            where -= 1
    return best, where


@borrowing
def _look(
    corners: Array, label: Index, balls: Single, left: Index, lows: Single, count: int, most: np.float32,
    best: float, where: int, numbers: Array, singles: Single, places: Index,
) -> tuple[float, int]:  # fmt: skip
    """Exact distances of what is left: only of triangles whose ball may be nearer than ``most``."""
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    picked, names, chosen = places[PICKED:PLACES], places[NAMES:PICKED], 0
    block, work = numbers[NUMBERS - CORNERS : NUMBERS], numbers[QUERY : QUERY + WORK]
    for i in range(count):
        if not lows[i] > most:
            chosen = _in_reach(balls, left[i], probe, float(most), gaps, picked, chosen)
        while chosen >= LANES or (chosen > 0 and i == count - 1):
            last = chosen - 1
            chosen = _pick(corners, label, picked, chosen, block, names)
            best, lane = nearest_of_block(block, numbers[:QUERY], best, work)
            if lane >= 0:
                where = picked[min(chosen + lane, last)]
                most = min(most, np.float32(best) + probe[9])
    return best, where


@borrowing
def _push(first: int, last: int, gaps: Single, most: np.float32, waiting: Index, bounds: Single, top: int) -> int:
    """Children that are not farther than ``most`` onto the stack, the nearest last; how much waits there then."""
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


@borrowing
def _clearance(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, upper: float, numbers: Array, singles: Single, places: Index,
) -> tuple[float, int, int]:  # fmt: skip
    """Smallest distance of the tool's surface, its segment and place; (upper, −1, −1) when none is nearer."""
    least, segment, where = upper, -1, -1
    for s in range(len(radius)):
        if least + radius[s] > 0.0:
            _set_out(start[s], end[s], frame, numbers, singles)
            gap, place = _nearest(
                boxes, corners, label, balls, level, least + radius[s], -1, numbers, singles, places
            )  # fmt: skip
            if place >= 0:
                least, segment, where = gap - radius[s], s, place
    return least, segment, where


@compiled
def wide_clearance(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, upper: float,
) -> float:  # fmt: skip
    """Smallest distance of the tool's surface, or ``upper`` when nothing is nearer."""
    numbers, singles, places = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(PLACES, np.int32)
    return _clearance(
        boxes, corners, label, balls, frame, level, start, end, radius, upper, numbers, singles, places
    )[0]  # fmt: skip


@compiled
def wide_closest(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array,
) -> tuple[Array, int, int]:  # fmt: skip
    """The row of the pair with the smallest distance, its segment and its triangle."""
    numbers, singles, places = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(PLACES, np.int32)
    lanes, rows, labels = np.empty(LANES + 1, np.uint64), np.empty((1, 10)), np.empty((1, 2), np.int32)
    _, s, place = _clearance(
        boxes, corners, label, balls, frame, level, start, end, radius, np.inf, numbers, singles, places
    )
    _one_row(corners, label, place, start[s], end[s], radius[s], frame, rows, labels, numbers, singles, places, lanes)
    return rows[0], s, label[place]


@borrowing
def _one_row(
    corners: Array, label: Index, place: int, start: Array, end: Array, radius: float, frame: Array,
    rows: Array, labels: Index, numbers: Array, singles: Single, places: Index, lanes: Lanes,
) -> None:  # fmt: skip
    """The row of one segment and the triangle at one place."""
    block, alone = place // LANES, places[:LANES]
    _set_out(start, end, frame, numbers, singles)
    alone[:] = -1
    alone[place % LANES] = label[place]
    append_block(
        corners[CORNERS * block : CORNERS * (block + 1)], alone,
        numbers[:QUERY], radius, np.inf, 0, numbers[QUERY : QUERY + WORK], lanes, rows, labels, 0, np.inf,
    )  # fmt: skip


@compiled
def wide_points(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index, points: Array
) -> tuple[Array, Array, Index]:
    """Distance (n,), closest point (n, 3) and triangle (n,) of each point (n, 3)."""
    distance, closest, triangle = np.empty(len(points)), np.empty(points.shape), np.empty(len(points), np.int32)
    numbers, singles, places = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(PLACES, np.int32)
    _points(
        boxes, corners, label, balls, frame, level, points,
        distance, closest, triangle, numbers, singles, places,
    )  # fmt: skip
    return distance, closest, triangle


@borrowing
def _points(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index, points: Array,
    distance: Array, closest: Array, triangle: Index, numbers: Array, singles: Single, places: Index,
) -> None:  # fmt: skip
    query, work = numbers[:QUERY], numbers[QUERY : QUERY + WORK]
    block = -1  # the one before is a good guess when the points follow each other
    for i in range(len(points)):
        _set_out(points[i], points[i], frame, numbers, singles)
        distance[i], place = _nearest(boxes, corners, label, balls, level, np.inf, block, numbers, singles, places)
        block = place // LANES
        block_gaps(corners[CORNERS * block : CORNERS * (block + 1)], query, np.inf, work)
        for k in range(3):
            closest[i, k] = points[i, k] + work[LANES * (2 + k) + place % LANES]
        triangle[i] = label[place]


@compiled
def wide_places(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, reach: float, room: int,
) -> tuple[Index, Index]:  # fmt: skip
    """Places (n,) of the triangles within ``reach`` of each segment's surface, and how many (S,) for each segment."""
    numbers, singles, work = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(PLACES, np.int32)
    count = np.empty(len(radius), np.int32)
    while True:
        places = np.empty(room, np.int32)
        found = _places(
            boxes, corners, label, balls, frame, level, start, end, radius, reach,
            places, count, numbers, singles, work,
        )  # fmt: skip
        if found + LANES <= room:
            return places[:found], count
        room = found + LANES


@borrowing
def _places(
    boxes: Single, corners: Array, label: Index, balls: Single, frame: Array, level: Index,
    start: Array, end: Array, radius: Array, reach: float,
    places: Index, counts: Index, numbers: Array, singles: Single, room: Index,
) -> int:  # fmt: skip
    probe, gaps, waiting, near = singles[:PROBE], singles[PROBE : PROBE + LANES], room[:STACK], room[STACK:PLACES]
    picked = room[PICKED:PLACES]
    found, blocks = 0, level[1]
    for s in range(len(radius)):
        limit, before = max(reach + radius[s], 0.0), found
        _set_out(start[s], end[s], frame, numbers, singles)
        top, chosen = 1, 0
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top]
            box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
            first, last = _children(node, level)
            if first >= blocks:
                top = _near(first, last, gaps, limit, waiting, top)
                continue
            for i in range(_near(first, last, gaps, limit, near, 0)):
                chosen = _in_reach(balls, near[i], probe, limit, gaps, picked, chosen)
                if chosen >= LANES:
                    chosen, found = _places_of_picked(
                        corners, label, picked, chosen, limit, places, found, numbers, room
                    )
        if chosen > 0:
            chosen, found = _places_of_picked(corners, label, picked, chosen, limit, places, found, numbers, room)
        counts[s] = found - before
    return found


@borrowing
def _places_of_picked(
    corners: Array, label: Index, picked: Index, count: int, limit: float,
    places: Index, found: int, numbers: Array, room: Index,
) -> tuple[int, int]:  # fmt: skip
    """As ``_rows_of_picked``, but only the places of the triangles that are near enough."""
    block, names, work = numbers[NUMBERS - CORNERS : NUMBERS], room[NAMES:PICKED], numbers[QUERY : QUERY + WORK]
    last = count - 1
    count = _pick(corners, label, picked, count, block, names)
    block_gaps(block, numbers[:QUERY], limit, work)
    for j in range(LANES):
        if found < len(places):
            places[found] = picked[min(count + j, last)]
        found += int((work[j] <= limit * limit) & (names[j] >= 0))
    return count, found


@compiled
def corners_at(corners: Array, places: Index) -> Array:
    """Corners (n, 9) of the triangles at some places."""
    picked = np.empty((len(places), 9))
    for i in range(len(places)):
        at = CORNERS * (places[i] // LANES) + places[i] % LANES
        for k in range(9):
            picked[i, k] = corners[at + LANES * k]
    return picked
