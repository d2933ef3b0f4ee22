"""Exact pairs and distances among a list of triangles near a tool; compiled, arrays in and out.

Triangles are stored in blocks of 16 (``block_kernels``), the boxes of 16 blocks in nodes (``box_simd``). Unused lanes
of a last block repeat its last triangle with the label −1; the boxes of missing blocks lie infinitely far away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array, Float32Array, Int32Array, UInt64Array
from ..kernels.compiled import compiled, no_refcount
from .block_kernels import COLUMNS, CORNERS, LANES, QUERY, WORK, block_gaps, describe, finish
from .box_simd import NODE, PROBE, box_gaps, describe_single
from .rows_kernel import own_normal

NUMBERS = QUERY + WORK
SINGLES = PROBE + LANES
QUERY_SPACE = NUMBERS + 3 + SINGLES // 2 + LANES + 1  # workspace of ``pairs_into`` in one array of float64
_COLUMNS, _FIRST, _STRIDE = np.uint64(10), np.uint64(COLUMNS), np.uint64(LANES)
_COINCIDENT = 1e-9  # mm; below it the direction between two points is dominated by rounding
_FAR = np.float32(1e30)


class Candidates(NamedTuple):
    """Triangles near each segment of a tool: N nodes of 16 boxes of 16 triangles, lengths in mm.

    boxes: (96 N,) float32, see ``box_simd``; relative to the frame's origin.
    corners: (2304 N,) the blocks, see ``block_kernels``; patient frame.
    label: (256 N,) face of the mesh in each lane; −1 in unused lanes.
    frame: (4,) origin of the boxes and the largest coordinate relative to it.
    offset: (S + 1,) segment s owns the nodes offset[s] to offset[s + 1].
    """

    boxes: Float32Array
    corners: Array
    label: Int32Array
    frame: Array
    offset: Int32Array


@no_refcount
def box_of_block(corners: Array, frame: Array, lane: int, node: Float32Array) -> None:
    """Write the box around the 16 triangles of a block into lane ``lane`` of a node, rounded outwards."""
    for k in range(3):
        low, high = np.inf, -np.inf
        for j in range(LANES):
            for c in range(3):
                low = min(low, corners[LANES * (3 * c + k) + j])
                high = max(high, corners[LANES * (3 * c + k) + j])
        put_box(low - frame[k], high - frame[k], frame[3], k, lane, node)


@no_refcount
def put_box(low: float, high: float, far: float, k: int, lane: int, node: Float32Array) -> None:
    """Write centre and half extent of a box along axis k into a lane, enlarged by the rounding of float32."""
    centre = np.float32(0.5 * (low + high))
    node[LANES * k + lane] = centre
    node[LANES * (3 + k) + lane] = np.float32((max(high - centre, centre - low) + 1e-7 * far) * 1.000001)


@no_refcount
def empty_boxes(first: int, node: Float32Array) -> None:
    """Put infinitely distant boxes into the lanes from ``first`` on."""
    for lane in range(first, LANES):
        for k in range(3):
            node[LANES * k + lane] = _FAR
            node[LANES * (3 + k) + lane] = np.float32(0.0)


def list_views(store: Array, segments: int) -> tuple[Float32Array, Array, Int32Array, Array, Int32Array]:
    """Views of the arrays of ``Candidates`` in one buffer, stored as frame, offset, corners, boxes, label."""
    head = _head(segments)
    offset = store[4:head].view(np.int32)[: segments + 1]
    nodes = int(offset[segments])
    boxes = head + CORNERS * LANES * nodes
    label = boxes + NODE // 2 * nodes
    return (
        store[boxes:label].view(np.float32), store[head:boxes], store[label:].view(np.int32), store[:4], offset
    )  # fmt: skip


def _head_of(segments: int) -> int:
    """Length of frame and offsets, rounded up to whole vectors."""
    return 8 + 4 * ((segments + 1) // 8)


_head = no_refcount(_head_of)
list_views_compiled = no_refcount(list_views)  # only for no_refcount kernels: its views are not reference counted


@compiled
def pack(vertices: Array, faces: Int32Array, labels: Int32Array, segments: int, frame: Array) -> Array:
    """The buffer of ``list_views`` from labels (n, 2) of pairs, ordered by segment; triangles keep their order."""
    offset = np.zeros(2 * (_head(segments) - 4), np.int32)
    for i in range(len(labels)):
        offset[labels[i, 0] + 1] += 1
    for s in range(segments):
        offset[s + 1] = offset[s] + (offset[s + 1] + LANES * LANES - 1) // (LANES * LANES)
    store = np.empty(_head(segments) + (CORNERS * LANES + (NODE + LANES * LANES) // 2) * offset[segments])
    _fill(vertices, faces, labels, segments, frame, offset, store)
    return store


@no_refcount
def _fill(
    vertices: Array,
    faces: Int32Array,
    labels: Int32Array,
    segments: int,
    origin: Array,
    counted: Int32Array,
    store: Array,
) -> None:
    head = store[4 : _head(segments)].view(np.int32)
    for i in range(len(head)):
        head[i] = counted[i]
    boxes, corners, names, frame, offset = list_views_compiled(store, segments)
    for k in range(4):
        frame[k] = origin[k]
    for i in range(len(names)):
        names[i] = -1
    for node in range(len(boxes) // NODE):
        empty_boxes(0, boxes[NODE * node : NODE * (node + 1)])
    first = 0
    while first < len(labels):
        segment, last = labels[first, 0], first
        while last < len(labels) and labels[last, 0] == segment:
            last += 1
        slot = LANES * LANES * offset[segment]
        for place in range(first, first + LANES * ((last - first + LANES - 1) // LANES)):
            face, k = labels[min(place, last - 1), 1], slot // LANES
            block = corners[CORNERS * k : CORNERS * (k + 1)]
            for c in range(3):
                for i in range(3):
                    block[LANES * (3 * c + i) + slot % LANES] = vertices[faces[face, c], i]
            if place < last:
                names[slot] = face
            slot += 1
            if slot % LANES == 0:
                box_of_block(block, frame, k % LANES, boxes[NODE * (k // LANES) : NODE * (k // LANES + 1)])
        first = last


@no_refcount
def _touching_row(corners: Array, j: int, query: Array, spare: Array, row: Array) -> None:
    """Set the row's normal to that of the triangle, right-handed about its corners, if axis and triangle intersect."""
    ux, uy, uz = corners[48 + j] - corners[j], corners[64 + j] - corners[16 + j], corners[80 + j] - corners[32 + j]
    vx, vy, vz = corners[96 + j] - corners[j], corners[112 + j] - corners[16 + j], corners[128 + j] - corners[32 + j]
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = np.sqrt(x * x + y * y + z * z)
    share = 1.0 / size if size > 0.0 else 1.0
    spare[0], spare[1], spare[2] = x * share, y * share, z * share
    own_normal(query[3:6], spare, row)


@no_refcount
def append_block(
    corners: Array, label: Int32Array, query: Array, radius: float, limit: float, segment: int,
    work: Array, lanes: UInt64Array, rows: Array, labels: Int32Array, found: int, best: float,
) -> tuple[int, float]:  # fmt: skip
    """Append the rows of a block's pairs within ``limit`` mm of the axis.

    rows: (R, 10); if there are more than R rows, the first R are written and all are counted.

    Returns:
        The number of rows so far and the smallest squared distance so far.
    """
    if block_gaps(corners, query, limit, work) == 0:
        return found, best
    finish(query, radius, work)
    square, passing = limit * limit, 0
    for j in range(LANES):
        lanes[passing] = j
        passing += int((work[j] <= square) & (label[j] >= 0))
    least = best
    for i in range(passing):
        least = min(least, work[lanes[i]])
    for i in range(min(passing, len(labels) - found)):
        # Unsigned indices: numba checks the sign of signed indices.
        j, row = lanes[i], np.uint64(found + i)
        for k in range(_COLUMNS):
            rows[row, k] = work[j + _FIRST + _STRIDE * k]
        labels[row, 0], labels[row, 1] = segment, label[j]
    if least < _COINCIDENT * _COINCIDENT:
        for i in range(min(passing, len(labels) - found)):
            if work[lanes[i]] < _COINCIDENT * _COINCIDENT:
                _touching_row(corners, int(lanes[i]), query, work[COLUMNS : COLUMNS + 3], rows[found + i])
    return found + passing, least


@no_refcount
def query_views(space: Array) -> tuple[Array, Array, Float32Array, UInt64Array]:
    """Views of a workspace (QUERY_SPACE,): numbers, extent of a segment (3,), singles and lanes."""
    singles, lanes = NUMBERS + 3, NUMBERS + 3 + SINGLES // 2
    return (
        space[:NUMBERS], space[NUMBERS:singles], space[singles:lanes].view(np.float32), space[lanes:].view(np.uint64)
    )  # fmt: skip


@no_refcount
def pairs_into(
    boxes: Float32Array, corners: Array, label: Int32Array, frame: Array, first: int, last: int,
    p: Array, d: Array, radius: float, threshold: float, segment: int, rows: Array, labels: Int32Array, found: int,
    numbers: Array, singles: Float32Array, lanes: UInt64Array,
) -> tuple[int, float]:  # fmt: skip
    """Append the exact pairs of one segment p + t·d whose distance is at most ``threshold`` mm.

    Args:
        boxes, corners, label, frame: of ``Candidates``; first, last: the segment's nodes are first … last − 1.
        p, d: (3,) mm; radius: of the capsule, mm; segment: its index, for the labels.
        rows: (R, 10) distance, normal, on the axis, on the surface; labels: (R, 2) int32 segment, triangle. Further
            columns of either are left alone.
        found: number of rows already written.
        numbers, singles, lanes: workspace, (NUMBERS,), (SINGLES,) float32 and (17,) uint64.

    Returns:
        The number of rows and the smallest distance of their pairs in mm, ∞ without pairs.
        If there are more than R rows, the first R are written and all are counted.
    """
    limit = threshold + radius
    best = np.inf
    if limit >= 0.0:
        query, work = numbers[:QUERY], numbers[QUERY:NUMBERS]
        probe, gaps = singles[:PROBE], singles[PROBE:SINGLES]
        describe(p, d, query)
        describe_single(p, d, frame, probe)
        for node in range(first, last):
            box_gaps(boxes[NODE * node : NODE * (node + 1)], probe, gaps)
            for lane in range(LANES):
                k = LANES * node + lane
                if not gaps[lane] > limit and label[LANES * k] >= 0:
                    found, best = append_block(
                        corners[CORNERS * k : CORNERS * (k + 1)], label[LANES * k : LANES * (k + 1)],
                        query, radius, limit, segment, work, lanes, rows, labels, found, best,
                    )  # fmt: skip
    return found, np.sqrt(best) - radius


@compiled
def segment_least(
    boxes: Float32Array, corners: Array, label: Int32Array, frame: Array, first: int, last: int,
    p: Array, d: Array, bound: float,
) -> float:  # fmt: skip
    """Exact distance in mm of the axis p + t·d to the nodes first … last − 1, or ``bound`` if that is smaller."""
    numbers, singles = np.empty(NUMBERS), np.empty(SINGLES, np.float32)
    gaps = np.empty(LANES * max(last - first, 0), np.float32)
    return least_with(boxes, corners, label, frame, first, last, p, d, bound, numbers, singles, gaps)


@no_refcount
def least_with(
    boxes: Float32Array, corners: Array, label: Int32Array, frame: Array, first: int, last: int,
    p: Array, d: Array, bound: float, numbers: Array, singles: Float32Array, gaps: Float32Array,
) -> float:  # fmt: skip
    """``segment_least`` with a workspace: (NUMBERS,), (SINGLES,) float32 and 16 float32 for each node.

    The block with the nearest box is measured first: its distance rejects most of the others.
    """
    query, work, probe = numbers[:QUERY], numbers[QUERY:NUMBERS], singles[:PROBE]
    describe(p, d, query)
    describe_single(p, d, frame, probe)
    seed, least = -1, np.float32(np.inf)
    for node in range(last - first):
        here = gaps[LANES * node : LANES * (node + 1)]
        box_gaps(boxes[NODE * (first + node) : NODE * (first + node + 1)], probe, here)
        for lane in range(LANES):
            if here[lane] < least:
                seed, least = LANES * node + lane, here[lane]
    best = bound
    for turn in range(-1, LANES * (last - first)):
        lane = seed if turn < 0 else turn
        if lane < 0 or turn == seed or gaps[lane] > best:
            continue
        k = LANES * first + lane
        if label[LANES * k] >= 0:
            best = nearest_of_block(corners[CORNERS * k : CORNERS * (k + 1)], query, best, work)[0]
    return best


@no_refcount
def nearest_of_block(corners: Array, query: Array, best: float, work: Array) -> tuple[float, int]:
    """Return the minimum of ``best`` and the 16 distances in mm from the axis, and its lane; −1 if it is ``best``."""
    if block_gaps(corners, query, best, work) == 0:
        return best, -1
    square, where = best * best, -1
    for j in range(LANES):
        if work[j] < square:
            square, where = work[j], j
    return (best, -1) if where < 0 else (np.sqrt(square), where)
