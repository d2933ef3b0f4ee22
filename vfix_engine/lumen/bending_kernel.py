"""Bends of the distal links with two parameters, judged against the pathway, compiled: Kwok 2013, eq. 10-20.

Both families of bends, (10) and (19), are Δq = a · one + b · two with two given vectors: a ``plane`` (2, 2L'). What the
robot does is clamp(q̃ + Δq), so the Δq that counts is clamp(q̃ + Δq) − q̃; cost and deviations are of that one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, compiled
from ..robots.snake_kernel import snake_frames
from .query_fast import link_deviations

Array = NDArray[np.float64]
Index = NDArray[np.int64]

Q_MAX, LENGTH, TOWARDS_X, TOWARDS_Y, LOW, HIGH, FARTHEST = range(7)  # of ``aims``
AIMS = 7


class Lumen(NamedTuple):
    """What the query is asked about: pathway, windows (L', 2), base (4, 4) of {l}, vertex blocks."""

    rows: Array
    polar: Array
    window: Index
    base: Array
    lanes: Array
    ball: Array
    start: Index
    number: Index


class Scratch(NamedTuple):
    """Memory to work in; ``depth`` (L',) has the D_i of the last bend that was judged, in mm."""

    frames: Array
    depth: Array
    vertex: Index
    segment: Index
    work: Array
    delta: Array
    q: Array


@borrowing
def bend(rest: Array, plane: Array, a: float, b: float, q_max: float, delta: Array, q: Array) -> None:
    """Δq (2L',) with joints at their limits, and clamp(q̃ + Δq) (2L',) with the very bits that a caller gets for it."""
    for k in range(len(rest)):
        delta[k] = min(max(rest[k] + (a * plane[0, k] + b * plane[1, k]), -q_max), q_max) - rest[k]
        q[k] = min(max(rest[k] + delta[k], -q_max), q_max)


@borrowing
def tip_of(delta: Array, length: float) -> tuple[float, float, float]:
    """x_eff of (11): where the last frame's origin is in {l} when the joints are at Δq, mm."""
    x, y, z = 0.0, 0.0, 0.0
    for link in range(len(delta) // 2 - 1, -1, -1):
        a, b = delta[2 * link], delta[2 * link + 1]
        z += length
        if b != 0.0:  # Rot_y
            c, s = math.cos(b), math.sin(b)
            x, z = c * x + s * z, c * z - s * x
        if a != 0.0:  # Rot_x
            c, s = math.cos(a), math.sin(a)
            y, z = c * y - s * z, s * y + c * z
    return x, y, z


@borrowing
def cost_of(rest: Array, plane: Array, aims: Array, a: float, b: float, scratch: Scratch) -> float:
    """z_eff/z_max of (14) and (20); infinite where the tip does not go the wanted way, d · d^e > 0 of (17)."""
    bend(rest, plane, a, b, aims[Q_MAX], scratch.delta, scratch.q)
    x, y, z = tip_of(scratch.delta, aims[LENGTH])
    towards = aims[TOWARDS_X] * x + aims[TOWARDS_Y] * y
    if (aims[TOWARDS_X] != 0.0 or aims[TOWARDS_Y] != 0.0) and not towards > 0.0:
        return math.inf
    cost: float = z / (aims[LENGTH] * 0.5 * len(rest))
    return cost


@compiled
def judge(
    lumen: Lumen, bound: Array, rest: Array, plane: Array, aims: Array, a: float, b: float, scratch: Scratch
) -> float:
    """The largest D_i − b_i of (15)-(17) in mm; what is not above 0 is within the bounds. One query evaluation."""
    bend(rest, plane, a, b, aims[Q_MAX], scratch.delta, scratch.q)
    snake_frames(scratch.q, lumen.base, aims[LENGTH], scratch.frames)
    link_deviations(
        lumen.rows, lumen.polar, lumen.window, scratch.frames, lumen.lanes, lumen.ball, lumen.start, lumen.number,
        scratch.depth, scratch.vertex, scratch.segment, scratch.work,
    )  # fmt: skip
    most = -math.inf
    for link in range(len(bound)):
        if not scratch.depth[link] < math.inf:
            return math.inf
        most = max(most, scratch.depth[link] - bound[link])
    return most
