"""Pairs within a distance in the wide box tree, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY, WORK
from .box_lanes import NODE, PROBE, box_gaps
from .candidate_kernels import append_block
from .compiled import borrowing, compiled
from .wide_search import (
    NAMES,
    NUMBERS,
    PICKED,
    PLACES,
    STACK,
    WORKSPACE,
    children,
    in_reach,
    keep_near,
    parts,
    pick,
    rows_of,
    set_out,
    tool_of,
    workspace_of,
)

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]
Lanes = NDArray[np.uint64]


@compiled
def wide_pairs(store: Array, tool: Array, threshold: float, capacity: int) -> tuple[Array, int]:
    """All pairs with distance − radius ≤ threshold (see ``pairs_from_made``) and how many.

    ``capacity``: how many are expected; more take a second pass.
    """
    while True:
        made = np.empty(11 * capacity)
        found = _pairs(store, tool, threshold, made, np.empty(WORKSPACE))
        if found <= capacity:
            return made, found
        capacity = found


@borrowing
def _pairs(store: Array, tool: Array, threshold: float, made: Array, workspace: Array) -> int:
    frame, level, corners, facets, boxes, label = parts(store)
    start, end, radius = tool_of(tool)
    rows, labels = rows_of(made)
    numbers, singles, places, lanes = workspace_of(workspace)
    query, work = numbers[:QUERY], numbers[QUERY : QUERY + WORK]
    probe, gaps = singles[:PROBE], singles[PROBE : PROBE + LANES]
    waiting, near, picked = places[:STACK], places[STACK : STACK + LANES], places[PICKED:PLACES]
    names = places[NAMES:PICKED]
    found, blocks = 0, level[1]
    for s in range(len(radius)):
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        set_out(start[s], end[s], frame, numbers, singles)
        top, chosen = 1, 0
        waiting[0] = level[len(level) - 1] - 1
        while top > 0:
            top -= 1
            node = waiting[top]
            box_gaps(boxes[NODE * (node - blocks) : NODE * (node - blocks + 1)], probe, gaps)
            first, last = children(node, level)
            if first >= blocks:
                top = keep_near(first, last, gaps, limit, waiting, top)
                continue
            count = keep_near(first, last, gaps, limit, near, 0)
            for i in range(count):
                block = near[i]
                after = in_reach(facets, block, probe, limit, gaps, picked, chosen)
                if after < 0:
                    found, _ = append_block(
                        corners[CORNERS * block : CORNERS * (block + 1)], label[LANES * block : LANES * (block + 1)],
                        query, radius[s], limit, s, work, lanes, rows, labels, found, np.inf,
                    )  # fmt: skip
                elif after >= LANES:
                    chosen, found = _rows_of_picked(
                        corners, label, picked, after, radius[s], limit, s, rows, labels, found, numbers, names, lanes
                    )
                else:
                    chosen = after
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
    count = pick(corners, label, picked, count, block, names)
    found, _ = append_block(
        block, names, numbers[:QUERY], radius, limit, segment,
        numbers[QUERY : QUERY + WORK], lanes, rows, labels, found, np.inf,
    )  # fmt: skip
    return count, found
