"""Pose of the tool at given joints, exact distances to the obstacles, and all near pairs, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Int32Array
from ..geometry.shape_kernels import shape_rows
from ..kernels.compiled import compiled, no_refcount
from ..proximity.block_kernels import LANES
from ..proximity.candidate_kernels import NUMBERS, SINGLES, pairs_into, segment_least
from ..proximity.candidates import still_valid
from ..robots.chain_kernel import forward
from .constants import CandidateTriangles, StepConstants


@no_refcount
def place(
    constants: StepConstants, q: Array, position: Array, rotation: Array, jacobian: Array, start: Array, end: Array
) -> None:
    """Write tip pose, Jacobian and the tool's segments (S, 3) at joints q (n,) into the other arguments."""
    forward(constants.chain, q, rotation, position, jacobian)
    for s in range(len(start)):
        for i in range(3):
            start[s, i], end[s, i] = position[i], position[i]
            for k in range(3):
                start[s, i] += rotation[i, k] * constants.start[s, k]
                end[s, i] += rotation[i, k] * constants.end[s, k]


@compiled
def candidates_suffice(constants: StepConstants, candidates: CandidateTriangles, start: Array, end: Array) -> bool:
    """Whether every triangle within the threshold of the tool in this pose is a candidate."""
    return still_valid(
        candidates.start, candidates.end, constants.radius, start, end, constants.radius, candidates.slack
    )


@compiled
def measure(
    constants: StepConstants, candidates: CandidateTriangles, start: Array, end: Array, threshold: float,
    distance: Array, rows: Array, labels: Int32Array, body: Int32Array,
) -> int:  # fmt: skip
    """Write distances (B, S) of obstacles and segments, capped at ``constants.threshold``, and pairs in ``threshold``.

    Args:
        threshold: that of the constants, or −∞ if only distances are needed.
        rows: (R, 10), labels: (R, 2), body: (R,) out; see ``pairs_into``.

    Returns:
        Number of pairs; the first R are written.
    """
    found = 0
    along = np.empty(3)
    surfaces = len(candidates.frame)
    scratch = np.empty((3, 10))
    numbers, singles, lanes = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(LANES + 1, np.uint64)
    for b in range(len(constants.margin)):
        for s in range(len(start)):
            before = found
            for k in range(3):
                along[k] = end[s, k] - start[s, k]
            if b < surfaces:
                first, last = candidates.first[b, s], candidates.first[b, s + 1]
                if first == last:
                    least = np.inf
                elif threshold > -np.inf:
                    found, least = pairs_into(
                        candidates.boxes, candidates.corners, candidates.label, candidates.frame[b], first, last,
                        start[s], along, constants.radius[s], threshold, s, rows, labels, found, numbers, singles,
                        lanes,
                    )  # fmt: skip
                else:
                    bound = constants.threshold + constants.radius[s]
                    least = -constants.radius[s] + segment_least(
                        candidates.boxes, candidates.corners, candidates.label, candidates.frame[b], first, last,
                        start[s], along, bound,
                    )  # fmt: skip
            else:
                z = b - surfaces
                count, least = shape_rows(
                    constants.shapes.kind[z],
                    constants.shapes.data[z],
                    start[s],
                    along,
                    constants.radius[s],
                    threshold,
                    scratch,
                    0,
                )
                for i in range(count):
                    if found < len(rows):
                        for k in range(10):  # array slices would compile numba's code for shape messages: seconds
                            rows[found, k] = scratch[i, k]
                        labels[found, 0], labels[found, 1] = s, -1
                    found += 1
            distance[b, s] = min(least, constants.threshold)  # propagates NaN
            for i in range(before, min(found, len(rows))):
                body[i] = b
    return found
