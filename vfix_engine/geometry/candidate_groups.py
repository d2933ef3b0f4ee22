"""Grouped pairs of a candidate list: its flat blocks as one pair each, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .block_kernels import CORNERS, LANES, QUERY, describe
from .box_lanes import PROBE, SHELL, describe_single, shell_gaps
from .candidate_kernels import NUMBERS, SINGLES, append_block
from .compiled import borrowing, compiled
from .shell_kernels import axes_of, extents, group_row, moments, put_shell

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]
Lanes = NDArray[np.uint64]


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
    corners: Array, label: Index, shells: Single, frame: Array, offset: Index,
    start: Array, end: Array, radius: Array, threshold: float, flat: float, exact_within: float, size: int,
) -> tuple[Array, Index]:  # fmt: skip
    """Rows and labels as ``wide_groups`` makes them, of the blocks of a candidate list."""
    rows, labels, along = np.empty((size, 10)), np.empty((size, 2), np.int32), np.empty(3)
    numbers, singles, lanes = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(LANES + 1, np.uint64)
    found = _groups(
        corners, label, shells, frame, offset, start, end, radius, threshold, flat, exact_within,
        rows, labels, along, numbers, singles, lanes,
    )  # fmt: skip
    return rows[:found], labels[:found]


@borrowing
def _groups(
    corners: Array, label: Index, shells: Single, frame: Array, offset: Index,
    start: Array, end: Array, radius: Array, threshold: float, flat: float, exact_within: float,
    rows: Array, labels: Index, along: Array, numbers: Array, singles: Single, lanes: Lanes,
) -> int:  # fmt: skip
    query, work, probe, gaps = numbers[:QUERY], numbers[QUERY:NUMBERS], singles[:PROBE], singles[PROBE:SINGLES]
    found, thin = 0, np.float32(0.5 * flat)
    for s in range(len(radius)):
        limit, exact = threshold + radius[s], max(exact_within + radius[s], 0.0)
        if limit < 0.0:
            continue
        for k in range(3):
            along[k] = end[s, k] - start[s, k]
        describe(start[s], along, query)
        describe_single(start[s], along, frame, probe)
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
