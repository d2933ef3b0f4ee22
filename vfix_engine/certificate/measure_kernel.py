"""Pose of the tool at given joints, exact distances to the obstacles, and all near pairs, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..geometry.shape_kernels import shape_rows
from ..kernels.compiled import compiled, merged, no_refcount
from ..proximity.candidate_kernels import pairs_into, query_views, segment_least
from ..proximity.candidates import still_valid
from ..robots.chain_kernel import forward
from .constants import CandidateTriangles, StepConstants
from .inputs import Inputs


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


@no_refcount
def candidates_suffice(constants: StepConstants, candidates: CandidateTriangles, start: Array, end: Array) -> bool:
    """Whether every triangle within the threshold of the tool in this pose is a candidate."""
    return still_valid(
        candidates.start, candidates.end, constants.radius, start, end, constants.radius, candidates.slack
    )


@merged
def measure(inputs: Inputs, start: Array, end: Array, within: Array, distance: Array) -> int:
    """Write distances (B, S) of obstacles and segments, capped at the threshold, and the pairs of the nearest ones.

    Args:
        within: (B, S) mm, at most the threshold: pairs up to this distance are written. Where there is none, those up
            to the threshold are, so that the distances do not depend on it.

    Returns:
        Number of pairs, of which as many are written as there are rows, see ``PairSpace``.
    """
    constants, candidates, rows, labels = inputs.constants, inputs.candidates, inputs.rows, inputs.labels
    shape, threshold, surfaces = inputs.scratch.shape, constants.threshold, len(candidates.frame)
    numbers, along, singles, lanes = query_views(inputs.scratch.query)
    found = 0
    for b in range(len(constants.margin)):
        for s in range(len(start)):
            before, least = found, np.inf
            for k in range(3):
                along[k] = end[s, k] - start[s, k]
            if b < surfaces:
                for limit in (within[b, s], threshold):
                    found, least = pairs_into(
                        candidates.boxes, candidates.corners, candidates.label, candidates.frame[b],
                        candidates.first[b, s], candidates.first[b, s + 1],
                        start[s], along, constants.radius[s], limit, s, rows, labels, found, numbers, singles, lanes,
                    )  # fmt: skip
                    if least < np.inf or limit >= threshold:
                        break
            else:
                kind, data = constants.shapes.kind[b - surfaces], constants.shapes.data[b - surfaces]
                count, least = shape_rows(kind, data, start[s], along, constants.radius[s], threshold, shape, 0)
                for i in range(count):
                    if found < len(rows):
                        for k in range(10):  # array slices would compile numba's code for shape messages: seconds
                            rows[found, k] = shape[i, k]
                        labels[found, 0], labels[found, 1] = s, -1
                    found += 1
            distance[b, s] = min(least, threshold)  # propagates NaN
            for i in range(before, min(found, len(rows))):
                labels[i, 2] = b
    return found


@compiled
def measure_distances(
    constants: StepConstants, candidates: CandidateTriangles, start: Array, end: Array, distance: Array
) -> None:
    """Write the distances of ``measure`` alone."""
    along, shape, surfaces = np.empty(3), np.empty((3, 10)), len(candidates.frame)
    for b in range(len(constants.margin)):
        for s in range(len(start)):
            for k in range(3):
                along[k] = end[s, k] - start[s, k]
            if b < surfaces:
                first, last, least = candidates.first[b, s], candidates.first[b, s + 1], np.inf
                if first < last:
                    least = -constants.radius[s] + segment_least(
                        candidates.boxes, candidates.corners, candidates.label, candidates.frame[b], first, last,
                        start[s], along, constants.threshold + constants.radius[s],
                    )  # fmt: skip
            else:
                kind, data = constants.shapes.kind[b - surfaces], constants.shapes.data[b - surfaces]
                _, least = shape_rows(kind, data, start[s], along, constants.radius[s], -np.inf, shape, 0)
            distance[b, s] = min(least, constants.threshold)  # propagates NaN
