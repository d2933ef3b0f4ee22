"""What every search of the wide box tree has in common, compiled: the descent and the picking of triangles.

A query allocates its workspace in one function and searches in another, which makes no array
(``compiled.borrowing``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY, WORK, describe
from .box_lanes import FACETS, NODE, PROBE, Words, describe_single, facet_gaps
from .compiled import borrowing, inlined

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]
Lanes = NDArray[np.uint64]

STACK = 16 * 10  # entries of a descent: at most 16 entries wait on each level of an index of 32 bits
LEFT = 256  # blocks that are kept for a look at their exact distances

# Workspace of a query: float64, float32 and int32.
KEPT = QUERY + WORK + 4  # of the nearest so far: t on the segment, the triangle's point minus p (3)
NUMBERS = KEPT + 4 + CORNERS
SINGLES = PROBE + LANES + STACK + LEFT
NAMES = STACK + LEFT
PICKED = NAMES + LANES
PLACES = PICKED + 2 * LANES
WORKSPACE = NUMBERS + (SINGLES + PLACES) // 2 + LANES + 1  # all of it in one array

HEAD = 16  # numbers before the blocks: the frame, then as int32 how many numbers the levels have, and these

_PICKED_OVER = 6  # of 16 triangles too far away: fewer, and the block is measured as it lies


def cut(store: Array) -> tuple[Array, Index, Array, Words, Single, Index]:
    """The arrays of a tree in its one piece of memory: frame, level, corners, facets, boxes, label.

    One array is handed over sooner than six: that took as long as a third of a query.
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


parts = borrowing(cut)  # this and the next three: for borrowing kernels only, what they return is not counted


@borrowing
def workspace_of(workspace: Array) -> tuple[Array, Single, Index, Lanes]:
    """The workspace of a query, cut from one array (WORKSPACE,): NUMBERS, SINGLES, PLACES and LANES + 1."""
    one, two, three = NUMBERS, NUMBERS + SINGLES // 2, NUMBERS + SINGLES // 2 + PLACES // 2
    return (
        workspace[:one], workspace[one:two].view(np.float32), workspace[two:three].view(np.int32),
        workspace[three:].view(np.uint64),
    )  # fmt: skip


@borrowing
def rows_of(made: Array) -> tuple[Array, Index]:
    """Rows (R, 10) and labels (R, 2) in one array (11 R,), see ``pairs_from_made``."""
    count = len(made) // 11
    return made[: 10 * count].reshape(count, 10), made[10 * count :].view(np.int32).reshape(count, 2)


@borrowing
def tool_of(packed: Array) -> tuple[Array, Array, Array]:
    """Start (S, 3), end (S, 3) and radius (S,) of packed ``Segments``."""
    count = len(packed) // 7
    return (
        packed[: 3 * count].reshape(count, 3), packed[3 * count : 6 * count].reshape(count, 3), packed[6 * count :]
    )  # fmt: skip


@borrowing
def set_out(start: Array, end: Array, frame: Array, numbers: Array, singles: Single) -> None:
    """Describe the segment from ``start`` to ``end`` (3,) in the workspace of a query."""
    # The start goes into the workspace as well: one that is read-only is another type, and would be compiled for again.
    p, d = numbers[:3], numbers[QUERY + WORK : QUERY + WORK + 3]
    for k in range(3):
        p[k], d[k] = start[k], end[k] - start[k]
    describe(p, d, numbers[:QUERY])
    describe_single(p, d, frame, singles[:PROBE])


@borrowing
def children(node: int, level: Index) -> tuple[int, int]:
    """The first child of a node and the one behind its last; blocks are numbered from 0, nodes behind them."""
    deep = 1
    while node >= level[deep + 1]:
        deep += 1
    first = level[deep - 1] + LANES * (node - level[deep])
    return first, min(first + LANES, level[deep])


@inlined
def keep_near(first: int, last: int, gaps: Single, limit: float, places: Index, top: int) -> int:
    """Those of the children first … last − 1 that may be within ``limit``, from places[top] on; the place behind."""
    for child in range(first, last):
        places[top] = child
        top += int(not gaps[child - first] > limit)
    return top


@borrowing
def in_reach(facets: Words, block: int, probe: Single, limit: float, gaps: Single, picked: Index, count: int) -> int:
    """Places of a block's triangles that may be within ``limit``, from picked[count] on; the place behind.

    −1 when most of the block may be: then it is measured as it is, which costs less than picking.
    """
    over = facet_gaps(facets[FACETS * block : FACETS * (block + 1)], probe, np.float32(limit), gaps)
    if over == LANES:
        return count
    if over <= _PICKED_OVER:
        return -1
    for j in range(LANES):
        picked[count] = LANES * block + j
        count += int(not gaps[j] > limit)
    return count


@borrowing
def pick(corners: Array, label: Index, picked: Index, count: int, block: Array, names: Index) -> int:
    """The last at most 16 of ``count`` picked triangles into a block of their own; how many are left."""
    first = max(count - LANES, 0)
    for j in range(LANES):
        place = picked[min(first + j, count - 1)]
        names[j] = label[place] if first + j < count else -1
        lane = corners[CORNERS * (place // LANES) + place % LANES : CORNERS * (place // LANES + 1)]
        for k in range(9):
            block[LANES * k + j] = lane[LANES * k]
    return first
