"""Where the tool is at given joints, and how near the bodies are to it: exact distances and all pairs, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Int32Array
from ..geometry.shape_kernels import shape_rows
from ..kernels.compiled import compiled, no_refcount
from ..proximity.block_kernels import LANES
from ..proximity.candidate_kernels import NUMBERS, SINGLES, pairs_into, segment_least
from ..proximity.candidates import still_valid
from ..robots.chain_kernel import forward
from .world import Cover, StepConstants


@no_refcount
def place(
    world: StepConstants, q: Array, position: Array, rotation: Array, jacobian: Array, start: Array, end: Array
) -> None:
    """Tip pose, Jacobian and the tool's segments (S, 3) at joints q (n,), written into the other arguments."""
    forward(world.chain, q, rotation, position, jacobian)
    for s in range(len(start)):
        for i in range(3):
            start[s, i], end[s, i] = position[i], position[i]
            for k in range(3):
                start[s, i] += rotation[i, k] * world.start[s, k]
                end[s, i] += rotation[i, k] * world.end[s, k]


@compiled
def covered(world: StepConstants, cover: Cover, start: Array, end: Array) -> bool:
    """Whether no triangle outside the cover can be within the threshold of the tool in this pose."""
    return still_valid(cover.start, cover.end, world.radius, start, end, world.radius, cover.slack)


@compiled
def measure(
    world: StepConstants, cover: Cover, start: Array, end: Array, threshold: float, distance: Array,
    rows: Array, labels: Int32Array, body: Int32Array,
) -> int:  # fmt: skip
    """Distance (B, S) of bodies and segments, no more than the world's threshold, and all pairs within ``threshold``.

    Args:
        threshold: that of the world, or −∞ where only distances are wanted.
        rows: (R, 10), labels: (R, 2), body: (R,) out; see ``pairs_into``.

    Returns:
        How many pairs there are; the first R are written.
    """
    found = 0
    along = np.empty(3)
    surfaces = len(cover.frame)
    scratch = np.empty((3, 10))
    numbers, singles, lanes = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(LANES + 1, np.uint64)
    for b in range(len(world.margin)):
        for s in range(len(start)):
            before = found
            for k in range(3):
                along[k] = end[s, k] - start[s, k]
            if b < surfaces:
                first, last = cover.first[b, s], cover.first[b, s + 1]
                if first == last:
                    least = np.inf
                elif threshold > -np.inf:
                    found, least = pairs_into(
                        cover.boxes, cover.corners, cover.label, cover.frame[b], first, last,
                        start[s], along, world.radius[s], threshold, s, rows, labels, found, numbers, singles, lanes,
                    )  # fmt: skip
                else:
                    bound = world.threshold + world.radius[s]
                    least = -world.radius[s] + segment_least(
                        cover.boxes, cover.corners, cover.label, cover.frame[b], first, last, start[s], along, bound
                    )
            else:
                z = b - surfaces
                count, least = shape_rows(
                    world.shapes.kind[z], world.shapes.data[z], start[s], along, world.radius[s], threshold, scratch, 0
                )
                for i in range(count):
                    if found < len(rows):
                        for k in range(10):  # a slice would compile numba's texts about shapes, which takes seconds
                            rows[found, k] = scratch[i, k]
                        labels[found, 0], labels[found, 1] = s, -1
                    found += 1
            distance[b, s] = min(least, world.threshold)  # a NaN stays one
            for i in range(before, min(found, len(rows))):
                body[i] = b
    return found
