"""Grouped pairs of a candidate list: its flat blocks as one pair each, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY
from .box_lanes import PROBE, SHELL, shell_gaps
from .candidate_kernels import NUMBERS, SINGLES, append_block, list_parts
from .compiled import borrowing, compiled
from .shell_kernels import axes_of, extents, group_row, moments, put_shell
from .wide_search import ROOM, room_for, rows_of, set_out, tool_of

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]


@compiled
def block_shells(corners: Array, label: Index, frame: Array) -> Single:
    """Boxes along their principal axes of all blocks, 16 to a node as in ``box_lanes``; zeros for no block."""
    shells = np.zeros(SHELL * (len(label) // (LANES * LANES)), np.float32)
    sums, spread, axes, slab = np.empty(10), np.empty((3, 3)), np.empty((4, 3)), np.empty((2, 3))
    for k in range(len(label) // LANES):
        if label[LANES * k] >= 0:
            block = corners[CORNERS * k : CORNERS * (k + 1)]
            moments(block, frame, sums)
            axes_of(sums, frame, spread, axes)
            extents(block, axes, slab)
            put_shell(axes, slab, frame, k % LANES, shells[SHELL * (k // LANES) : SHELL * (k // LANES + 1)])
    return shells


@compiled
def list_groups(
    store: Array, shells: Single, tool: Array, threshold: float, flat: float, exact_within: float, size: int
) -> tuple[Array, int]:
    """As ``wide_groups``, of the blocks of a candidate list of ``size`` triangles."""
    made = np.empty(11 * size)
    return made, _groups(store, shells, tool, threshold, flat, exact_within, made, np.empty(ROOM))


@borrowing
def _groups(
    store: Array, shells: Single, tool: Array, threshold: float, flat: float, exact_within: float,
    made: Array, room: Array,
) -> int:  # fmt: skip
    start, end, radius = tool_of(tool)
    _, corners, label, frame, offset = list_parts(store, len(radius))
    rows, labels = rows_of(made)
    numbers, singles, _, lanes = room_for(room)
    query, work, probe, gaps = numbers[:QUERY], numbers[QUERY:NUMBERS], singles[:PROBE], singles[PROBE:SINGLES]
    found, thin = 0, np.float32(0.5 * flat)
    for s in range(len(radius)):
        limit, exact = threshold + radius[s], max(exact_within + radius[s], 0.0)
        if limit < 0.0:
            continue
        set_out(start[s], end[s], frame, numbers, singles)
        for node in range(offset[s], offset[s + 1]):
            shell = shells[SHELL * node : SHELL * (node + 1)]
            shell_gaps(shell, probe, gaps)
            for lane in range(LANES):
                k = LANES * node + lane
                if gaps[lane] > limit or label[LANES * k] < 0:
                    continue
                if gaps[lane] > exact and shell[14 * LANES + lane] <= thin:
                    group_row(shell, lane, query, probe, frame, radius[s], rows[found])
                    labels[found, 0], labels[found, 1] = s, -1
                    found += 1
                else:
                    found, _ = append_block(
                        corners[CORNERS * k : CORNERS * (k + 1)], label[LANES * k : LANES * (k + 1)],
                        query, radius[s], limit, s, work, lanes, rows, labels, found, np.inf,
                    )  # fmt: skip
    return found
