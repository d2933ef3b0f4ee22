"""Construction of the 16-wide bounding volume hierarchy: blocks of 16 triangles, nodes of 16 boxes, no pointers.

Triangles are sorted so that every run of 16, of 16², and so on, is compact: ranges are split at the median along their
longest extent, at a power of two of blocks. The children of node i of a level are the nodes 16 i … 16 i + 15 of the
level below, so that the tree needs no links.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array, Float32Array, Int32Array
from ..kernels.compiled import compiled, inlined, no_refcount
from .block_kernels import CORNERS, LANES
from .box_simd import FACETS, FARTHEST, HEADER, NODE, unpacked
from .bvh16_search import HEAD, tree_views
from .candidate_kernels import box_of_block, empty_boxes, put_box


class Bvh16(NamedTuple):
    """The tree as arrays; B blocks, N nodes, lengths in mm.

    store: the buffer of all other arrays.
    boxes: (96 N,) float32, see ``box_simd``: first the nodes over the blocks, last the root.
    corners: (144 B,) the triangles, see ``block_kernels``; the last block repeats its last triangle.
    label: (16 B,) face of the mesh in each lane; −1 in unused lanes.
    facets: (56 B,) int32, the rounded triangles, see ``box_simd``.
    frame: (4,) origin of the boxes and the largest coordinate relative to it.
    level: (L + 1,) blocks are numbered from 0 and nodes after them; level l is level[l] … level[l + 1] − 1.
    """

    store: Array
    boxes: Float32Array
    corners: Array
    label: Int32Array
    facets: Int32Array
    frame: Array
    level: Int32Array


@compiled
def centres_of(vertices: Array, faces: Int32Array, frame: Array) -> Float32Array:
    """Centres (F, 3) of the triangles' boxes relative to the origin of the frame (4,), which is written."""
    count = len(faces)
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for f in range(count):
        for c in range(3):
            for k in range(3):
                x = vertices[faces[f, c], k]
                low[k], high[k] = min(low[k], x), max(high[k], x)
    for k in range(3):
        frame[k] = 0.5 * (low[k] + high[k])
    frame[3] = max(high[0] - low[0], max(high[1] - low[1], high[2] - low[2])) + 1e-9 * np.abs(frame[:3]).max()
    centres = np.empty((count, 3), np.float32)
    for f in range(count):
        i, j, h = faces[f, 0], faces[f, 1], faces[f, 2]
        for k in range(3):
            x, y, z = vertices[i, k], vertices[j, k], vertices[h, k]
            centres[f, k] = 0.5 * (min(x, min(y, z)) + max(x, max(y, z))) - frame[k]
    return centres


@compiled
def _swap(centres: Float32Array, order: Int32Array, i: int, j: int) -> None:
    order[i], order[j] = order[j], order[i]
    for k in range(3):
        centres[i, k], centres[j, k] = centres[j, k], centres[i, k]


@compiled
def _select(centres: Float32Array, order: Int32Array, first: int, last: int, middle: int, k: int) -> None:
    """Partition first … last − 1 at index ``middle`` along axis k (quickselect)."""
    low, high = first, last - 1
    while low < high:
        one, two, three = centres[low, k], centres[(low + high) // 2, k], centres[high, k]
        pivot = max(min(one, two), min(max(one, two), three))
        i, j = low, high
        while i <= j:
            while centres[i, k] < pivot:
                i += 1
            while centres[j, k] > pivot:
                j -= 1
            if i <= j:
                _swap(centres, order, i, j)
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@compiled
def sort_triangles(centres: Float32Array) -> Int32Array:
    """Order (F,) of the triangles in the tree; the centres are reordered too."""
    count = len(centres)
    order = np.arange(count).astype(np.int32)
    begin, stop = np.empty(64, np.int64), np.empty(64, np.int64)
    low, high = np.empty(3, np.float32), np.empty(3, np.float32)
    begin[0], stop[0] = 0, count
    top = 1
    while top > 0:
        top -= 1
        first, last = begin[top], stop[top]
        half = LANES
        while 2 * half < last - first:
            half *= 2
        if half >= last - first:
            continue
        low[:], high[:] = np.float32(np.inf), np.float32(-np.inf)
        for i in range(first, last):
            for k in range(3):
                low[k], high[k] = min(low[k], centres[i, k]), max(high[k], centres[i, k])
        axis = 0
        for k in range(1, 3):
            if high[k] - low[k] > high[axis] - low[axis]:
                axis = k
        _select(centres, order, first, last, first + half, axis)
        begin[top], stop[top] = first, first + half
        begin[top + 1], stop[top + 1] = first + half, last
        top += 2
    return order


@compiled
def levels_of(count: int) -> Int32Array:
    """First index of each level among blocks and nodes, and the end of the last; the blocks are level 0."""
    level = np.zeros(12, np.int32)
    width, top = (count + LANES - 1) // LANES, 1
    level[1] = width
    while width > 1 or top == 1:
        width = (width + LANES - 1) // LANES
        level[top + 1] = level[top] + width
        top += 1
    return level[: top + 1].copy()


@compiled
def fill_blocks(vertices: Array, faces: Int32Array, order: Int32Array, corners: Array, label: Int32Array) -> None:
    """Write the triangles into blocks, in their order."""
    count = len(order)
    for place in range(len(label)):
        face = order[min(place, count - 1)]
        at = CORNERS * (place // LANES) + place % LANES
        for c in range(3):
            vertex = faces[face, c]
            for k in range(3):
                corners[at + LANES * (3 * c + k)] = vertices[vertex, k]
        label[place] = face if place < count else -1


@compiled
def fill_boxes(corners: Array, frame: Array, level: Int32Array, boxes: Float32Array) -> None:
    """Write the boxes of all nodes, from the blocks upwards."""
    blocks = level[1]
    for i in range(level[2] - level[1]):
        node = boxes[NODE * i : NODE * (i + 1)]
        empty_boxes(0, node)
        for lane in range(min(LANES, blocks - LANES * i)):
            b = LANES * i + lane
            box_of_block(corners[CORNERS * b : CORNERS * (b + 1)], frame, lane, node)
    for deep in range(2, len(level) - 1):
        below, here = level[deep - 1] - blocks, level[deep] - blocks
        for i in range(level[deep + 1] - level[deep]):
            node = boxes[NODE * (here + i) : NODE * (here + i + 1)]
            empty_boxes(0, node)
            for lane in range(min(LANES, level[deep] - level[deep - 1] - LANES * i)):
                child = boxes[NODE * (below + LANES * i + lane) : NODE * (below + LANES * i + lane + 1)]
                _box_of_node(child, frame, lane, node)


@inlined
def _box_of_node(child: Float32Array, frame: Array, lane: int, node: Float32Array) -> None:
    for k in range(3):
        low, high = np.inf, -np.inf
        for j in range(LANES):
            centre, half = np.float64(child[LANES * k + j]), np.float64(child[LANES * (3 + k) + j])
            if centre < 1e29:
                low, high = min(low, centre - half), max(high, centre + half)
        put_box(low, high, frame[3], k, lane, node)


@compiled
def fill_facets(corners: Array, frame: Array, facets: Int32Array) -> None:
    """Write the rounded triangles of ``box_simd.facet_gaps``."""
    offsets, least, most = np.empty((3, 3, LANES)), np.empty(3), np.empty(3)  # middle, and two corners from there
    for b in range(len(facets) // FACETS):
        block, here = corners[CORNERS * b : CORNERS * (b + 1)], facets[FACETS * b : FACETS * (b + 1)]
        head = here[:HEADER].view(np.float32)
        least[:], most[:], widest, span = np.inf, -np.inf, 0.0, 0.0
        for k in range(3):
            for j in range(LANES):
                one, two = block[LANES * k + j] - frame[k], block[LANES * (3 + k) + j] - frame[k]
                three = block[LANES * (6 + k) + j] - frame[k]
                middle = (one + two + three) / 3.0
                offsets[0, k, j], offsets[1, k, j], offsets[2, k, j] = middle, one - middle, two - middle
                least[k], most[k] = min(least[k], middle), max(most[k], middle)
                widest = max(widest, max(abs(one - middle), abs(two - middle)))
            span = max(span, most[k] - least[k])
        head[3], head[4] = span * (1024.0 / 1023.0 * 1.000001), widest * (1024.0 / 511.0 * 1.000001)
        for k in range(3):
            head[k] = least[k] - np.float64(head[3])
        _pack_facets(offsets, head, here[HEADER:])
        _measure_facets(block, frame, here)


@no_refcount
def _pack_facets(offsets: Array, head: Float32Array, words: Int32Array) -> None:
    """Round centroids and corners (3, 3, 16) to ten bits."""
    for i in range(3):
        span = np.float64(head[3 if i == 0 else 4])
        share = 1024.0 / span if 0.0 < span < FARTHEST else 0.0
        for j in range(LANES):
            word = 0
            for k in range(3):
                from_one = np.float64(head[k]) + span if i == 0 else -0.5 * span
                step = np.rint((offsets[i, k, j] - from_one) * share)
                word |= int(min(max(step, 0.0), 1023.0)) << (12 if k == 0 else 2 if k == 1 else 22)
            words[LANES * i + j] = np.int32(word)


@no_refcount
def _measure_facets(block: Array, frame: Array, here: Int32Array) -> None:
    """Write the largest rounding error of a corner and the largest distance of a corner from its centroid."""
    head = here[:HEADER].view(np.float32)
    span, corner = np.float64(head[3]), np.float64(head[4])
    off, far = 0.0, 0.0
    for j in range(LANES):
        middle, one, two = unpacked(here[8 + j]), unpacked(here[24 + j]), unpacked(here[40 + j])
        off1, off2, off3, far1, far2, far3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            x = np.float64(head[k]) + span * np.float64(middle[k]) + frame[k]
            y, z = corner * (np.float64(one[k]) - 1.5), corner * (np.float64(two[k]) - 1.5)
            off1 += (x + y - block[LANES * k + j]) ** 2
            off2 += (x + z - block[LANES * (3 + k) + j]) ** 2
            off3 += (x - y - z - block[LANES * (6 + k) + j]) ** 2
            far1, far2, far3 = far1 + y * y, far2 + z * z, far3 + (y + z) ** 2
        off, far = max(off, max(off1, max(off2, off3))), max(far, max(far1, max(far2, far3)))
    head[5], head[6] = np.sqrt(off) * 1.000001, np.sqrt(far) * 1.000001


def build_bvh16(vertices: Array, faces: Int32Array, order: Int32Array | None = None) -> Bvh16:
    """The tree over vertices (V, 3) in mm and faces (F, 3); ``order`` (F,) replaces the sorting."""
    frame = np.empty(4)
    centres = centres_of(vertices, faces, frame)
    if order is None:
        order = sort_triangles(centres)
    level = levels_of(len(faces))
    blocks, nodes = int(level[1]), int(level[-1] - level[1])
    store = np.zeros(HEAD + (CORNERS + (FACETS + LANES) // 2) * blocks + NODE // 2 * nodes)
    store[:4] = frame
    head = store[4:HEAD].view(np.int32)
    head[0], head[1 : 1 + len(level)] = len(level), level
    frame, level, corners, facets, boxes, label = tree_views(store)
    fill_blocks(vertices, faces, order, corners, label)
    fill_boxes(corners, frame, level, boxes)
    fill_facets(corners, frame, facets)
    return Bvh16(store, boxes, corners, label, facets, frame, level)
