"""Bounds of the tool's motion between two poses, on which the certificate relies (HAZ-02)."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, IntArray
from ..kernels.compiled import compiled, no_refcount
from ..robots.chain_kernel import Chain
from .constants import unpack_constants


@no_refcount
def acceleration_bound(chain: Chain, links: Array, reach: float, q: Array, step: Array) -> float:
    """Bound ‖P''(s)‖ in mm for every point P of the tool on the motion q + s·step, s in [0, 1].

    ∂²P/∂q_i∂q_j, i ≤ j counted from the base, is z_i × ∂P/∂q_j for a revolute joint i and 0 for a prismatic one.
    ‖∂P/∂q_j‖ is 1 for a prismatic joint j and at most the lever arm of a revolute one: the summed lengths of all links
    between its origin and the point, prismatic joints with their largest extension during the motion.

    Args:
        links: (n,) distance of each joint's frame from that of the previous joint.
        reach: distance of the tool's farthest point from the last joint's frame.
    """
    lever, beyond, bound = reach, 0.0, 0.0
    for j in range(len(q) - 1, -1, -1):
        size = abs(step[j])
        if chain.revolute[j]:
            bound += size * (size * lever + 2.0 * beyond)
            beyond += size * lever
        else:
            lever += max(abs(q[j]), abs(q[j] + step[j]))
            beyond += size
        lever += links[j]
    return bound


@compiled
def motion_sag(numbers: Array, counts: IntArray, q: Array, q_after: Array) -> float:
    """Bound the deviation in mm of a point of the tool from the chord between its positions at q and q_after.

    numbers, counts: a ``PackedConstants``.
    """
    constants = unpack_constants(numbers, counts)
    return acceleration_bound(constants.chain, constants.links, constants.reach, q, q_after - q) / 8.0


@no_refcount
def chords(start: Array, end: Array, new_start: Array, new_end: Array, chord: Array) -> float:
    """Write the largest displacement (S,) of any point of each segment between two poses, and return that of all.

    One of the segment's ends has it.
    """
    largest = 0.0
    for s in range(len(chord)):
        one, two = 0.0, 0.0
        for k in range(3):
            one += (new_start[s, k] - start[s, k]) ** 2
            two += (new_end[s, k] - end[s, k]) ** 2
        chord[s] = np.sqrt(max(one, two))
        largest = max(largest, chord[s])
    return largest
