"""Common parts of the queries of the 16-wide bounding volume hierarchy, compiled: traversal, gathering of triangles.

A query allocates its workspace in one function and searches in another, which allocates nothing
(``compiled.no_refcount``).
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Float32Array, Int32Array, UInt64Array
from ..kernels.compiled import inlined, no_refcount
from .block_kernels import CORNERS, LANES, QUERY, WORK, describe
from .box_simd import FACETS, NODE, PROBE, describe_single, facet_gaps

STACK = 16 * 10  # entries of the traversal stack: at most 16 per level of a 32-bit index
REMAINING = 256  # blocks whose exact distances are computed together

# Workspace of a query: float64, float32 and int32.
NEAREST = QUERY + WORK + 4  # data of the nearest triangle so far: t on the segment, the triangle's point minus p (3)
NUMBERS = NEAREST + 4 + CORNERS
SINGLES = PROBE + LANES + STACK + REMAINING
NAMES = STACK + REMAINING
GATHERED = NAMES + LANES
PLACES = GATHERED + 2 * LANES
WORKSPACE = NUMBERS + (SINGLES + PLACES) // 2 + LANES + 1  # all of it in one array

HEAD = 16  # numbers before the blocks: the frame, then as int32 the length of ``level`` and its entries

_GATHER_ABOVE = 6  # of 16 triangles beyond the limit; with no more of them the whole block is measured


def tree_views(store: Array) -> tuple[Array, Int32Array, Array, Int32Array, Float32Array, Int32Array]:
    """Views of the arrays of a tree in its buffer: frame, level, corners, facets, boxes, label.

    Passing six arrays instead of one took a third of the time of a query.
    """
    head = store[4:HEAD].view(np.int32)
    level = head[1 : 1 + head[0]]
    blocks, nodes = int(level[1]), int(level[len(level) - 1] - level[1])
    facets = HEAD + CORNERS * blocks
    boxes = facets + FACETS // 2 * blocks
    label = boxes + NODE // 2 * nodes
    return (
        store[:4], level, store[HEAD:facets], store[facets:boxes].view(np.int32),
        store[boxes:label].view(np.float32), store[label:].view(np.int32),
    )  # fmt: skip


# This and the next three are only for no_refcount kernels: their views are not reference counted.
tree_views_compiled = no_refcount(tree_views)


@no_refcount
def workspace_of(workspace: Array) -> tuple[Array, Float32Array, Int32Array, UInt64Array]:
    """The workspace of a query in one array (WORKSPACE,): NUMBERS float64, SINGLES float32, PLACES int32, LANES + 1."""
    one, two, three = NUMBERS, NUMBERS + SINGLES // 2, NUMBERS + SINGLES // 2 + PLACES // 2
    return (
        workspace[:one], workspace[one:two].view(np.float32), workspace[two:three].view(np.int32),
        workspace[three:].view(np.uint64),
    )  # fmt: skip


@no_refcount
def rows_of(buffer: Array) -> tuple[Array, Int32Array]:
    """Rows (R, 10) and labels (R, 2) in one array (11 R,), see ``pairs_from_buffer``."""
    count = len(buffer) // 11
    return buffer[: 10 * count].reshape(count, 10), buffer[10 * count :].view(np.int32).reshape(count, 2)


@no_refcount
def tool_of(packed: Array) -> tuple[Array, Array, Array]:
    """Start (S, 3), end (S, 3) and radius (S,) of packed ``Segments``."""
    count = len(packed) // 7
    return (
        packed[: 3 * count].reshape(count, 3), packed[3 * count : 6 * count].reshape(count, 3), packed[6 * count :]
    )  # fmt: skip


@no_refcount
def describe_segment(start: Array, end: Array, frame: Array, numbers: Array, singles: Float32Array) -> None:
    """Write the constants of the segment from ``start`` to ``end`` (3,) into the workspace of a query."""
    # Copies the start too: a read-only array is another type, for which the callees would be compiled again.
    p, d = numbers[:3], numbers[QUERY + WORK : QUERY + WORK + 3]
    for k in range(3):
        p[k], d[k] = start[k], end[k] - start[k]
    describe(p, d, numbers[:QUERY])
    describe_single(p, d, frame, singles[:PROBE])


@no_refcount
def children(node: int, level: Int32Array) -> tuple[int, int]:
    """First child of a node and the end of its children; blocks are numbered from 0, nodes after them."""
    deep = 1
    while node >= level[deep + 1]:
        deep += 1
    first = level[deep - 1] + LANES * (node - level[deep])
    return first, min(first + LANES, level[deep])


@inlined
def push_near(first: int, last: int, gaps: Float32Array, limit: float, places: Int32Array, top: int) -> int:
    """Push the children first … last − 1 that may be within ``limit``; return the new top."""
    for child in range(first, last):
        places[top] = child
        top += int(not gaps[child - first] > limit)
    return top


@no_refcount
def push_within(
    facets: Int32Array,
    block: int,
    probe: Float32Array,
    limit: float,
    gaps: Float32Array,
    gathered: Int32Array,
    count: int,
) -> int:
    """Append the places of a block's triangles that may be within ``limit``; return the new count.

    −1 if most of the block may be within: then the whole block is measured, which costs less than gathering.
    """
    over = facet_gaps(facets[FACETS * block : FACETS * (block + 1)], probe, np.float32(limit), gaps)
    if over == LANES:
        return count
    if over <= _GATHER_ABOVE:
        return -1
    for j in range(LANES):
        gathered[count] = LANES * block + j
        count += int(not gaps[j] > limit)
    return count


@no_refcount
def gather(corners: Array, label: Int32Array, gathered: Int32Array, count: int, block: Array, names: Int32Array) -> int:
    """Copy the last at most 16 of ``count`` gathered triangles into a block; return the number left."""
    first = max(count - LANES, 0)
    for j in range(LANES):
        place = gathered[min(first + j, count - 1)]
        names[j] = label[place] if first + j < count else -1
        lane = corners[CORNERS * (place // LANES) + place % LANES : CORNERS * (place // LANES + 1)]
        for k in range(9):
            block[LANES * k + j] = lane[LANES * k]
    return first
