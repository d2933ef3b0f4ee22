"""Query of all pairs within a distance, by the 16-wide bounding volume hierarchy, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Int32Array, UInt64Array
from ..kernels.compiled import compiled, no_refcount
from .block_kernels import CORNERS, LANES, QUERY, WORK
from .box_simd import NODE, PROBE, box_gaps
from .bvh16_search import (
    GATHERED,
    NAMES,
    NUMBERS,
    PLACES,
    STACK,
    WORKSPACE,
    children,
    describe_segment,
    gather,
    push_near,
    push_within,
    rows_of,
    tool_of,
    tree_views_compiled,
    workspace_of,
)
from .candidate_kernels import append_block


@compiled
def bvh16_pairs(store: Array, tool: Array, threshold: float, capacity: int) -> tuple[Array, int]:
    """The buffer (see ``pairs_from_buffer``) and the number of all pairs with distance − radius ≤ threshold, in mm.

    ``capacity``: expected number of pairs; more take a second pass.
    """
    while True:
        buffer = np.empty(11 * capacity)
        found = _pairs(store, tool, threshold, buffer, np.empty(WORKSPACE))
        if found <= capacity:
            return buffer, found
        capacity = found


@no_refcount
def _pairs(store: Array, tool: Array, threshold: float, buffer: Array, workspace: Array) -> int:
    frame, level, corners, facets, boxes, label = tree_views_compiled(store)
    start, end, radius = tool_of(tool)
    rows, labels = rows_of(buffer)
    numbers, singles, places, lanes = workspace_of(workspace)
    query, work = numbers[:QUERY], numbers[QUERY : QUERY + WORK]
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    waiting, near, gathered = places[:STACK], places[STACK : STACK + LANES], places[GATHERED:PLACES]
    names = places[NAMES:GATHERED]
    found, blocks = 0, level[1]
    for s in range(len(radius)):
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        describe_segment(start[s], end[s], frame, numbers, singles)
        top, chosen = 1, 0
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top]
            box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
            first, last = children(node, level)
            if first >= blocks:
                top = push_near(first, last, gaps, limit, waiting, top)
                continue
            count = push_near(first, last, gaps, limit, near, 0)
            for i in range(count):
                block = near[i]
                after = push_within(facets, block, probe, limit, gaps, gathered, chosen)
                if after < 0:
                    found, _ = append_block(
                        corners[CORNERS * block : CORNERS * (block + 1)], label[LANES * block : LANES * (block + 1)],
                        query, radius[s], limit, s, work, lanes, rows, labels, found, np.inf,
                    )  # fmt: skip
                elif after >= LANES:
                    chosen, found = _rows_of_gathered(
                        corners, label, gathered, after, radius[s], limit, s, rows, labels, found, numbers, names, lanes
                    )
                else:
                    chosen = after
        if chosen > 0:
            chosen, found = _rows_of_gathered(
                corners, label, gathered, chosen, radius[s], limit, s, rows, labels, found, numbers, names, lanes
            )
    return found


@no_refcount
def _rows_of_gathered(
    corners: Array, label: Int32Array, gathered: Int32Array, count: int, radius: float, limit: float, segment: int,
    rows: Array, labels: Int32Array, found: int, numbers: Array, names: Int32Array, lanes: UInt64Array,
) -> tuple[int, int]:  # fmt: skip
    """Append the rows of the last at most 16 gathered triangles: (number still gathered, number of rows)."""
    block = numbers[NUMBERS - CORNERS : NUMBERS]
    count = gather(corners, label, gathered, count, block, names)
    found, _ = append_block(
        block, names, numbers[:QUERY], radius, limit, segment,
        numbers[QUERY : QUERY + WORK], lanes, rows, labels, found, np.inf,
    )  # fmt: skip
    return count, found
