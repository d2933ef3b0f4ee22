"""Bends of the distal links with two parameters, measured against the pathway, compiled: Kwok 2013, eq. 10-20.

Both families of bends, (10) and (19), are Δq = a · one + b · two with two fixed vectors: a ``plane`` (2, 2L'). The
robot moves to clamp(q̃ + Δq), so the effective Δq is clamp(q̃ + Δq) − q̃; cost and deviations refer to that.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled, no_refcount
from ...pathway.packed import PackedPathway
from ...pathway.query.query_blocks import VertexBlocks
from ...pathway.query.query_fast import largest_excess
from ...robots.snake_kernel import snake_frames


class DistalPathway(NamedTuple):
    """The distal links in their part of a pathway."""

    packed: PackedPathway
    blocks: VertexBlocks
    window: IntArray
    """(L', 2)."""
    base: Array
    """(4, 4) of {l}, mm in the patient frame."""
    rest: Array
    """(2L',) q̃ in rad."""
    bound: Array
    """(L',) mm, what each link may deviate."""
    q_max: float
    """rad."""
    length: float
    """mm, of a link."""


class Family(NamedTuple):
    """Bends Δq = a · plane[0] + b · plane[1] with ‖(a, b)‖ ≤ farthest, in directions from ``low`` to ``high``."""

    plane: Array
    """(2, 2L') rad."""
    towards: tuple[float, float]
    """Desired direction of the tip in x and y of {l}; (0, 0) for any."""
    low: float
    high: float
    """Angles of (a, b) in rad."""
    farthest: float


class BendWorkspace(NamedTuple):
    """Workspace: frames (L', 3, 4), Δq and q (2L',), and that of the query."""

    frames: Array
    delta: Array
    q: Array
    work: Array


@no_refcount
def bend(rest: Array, plane: Array, a: float, b: float, q_max: float, delta: Array, q: Array) -> None:
    """Δq (2L',) with joints at their limits, and clamp(q̃ + Δq) (2L',), bit by bit as returned to the caller."""
    for k in range(len(rest)):
        delta[k] = min(max(rest[k] + (a * plane[0, k] + b * plane[1, k]), -q_max), q_max) - rest[k]
        q[k] = min(max(rest[k] + delta[k], -q_max), q_max)


@no_refcount
def tip_of(delta: Array, length: float) -> tuple[float, float, float]:
    """x_eff of (11): origin of the last frame in {l} with the joints at Δq, mm."""
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


@no_refcount
def cost_of(lumen: DistalPathway, family: Family, a: float, b: float, scratch: BendWorkspace) -> float:
    """z_eff/z_max of (14) and (20); infinite where the tip is not in the desired direction, d · d^e > 0 of (17)."""
    bend(lumen.rest, family.plane, a, b, lumen.q_max, scratch.delta, scratch.q)
    x, y, z = tip_of(scratch.delta, lumen.length)
    along_x, along_y = family.towards
    if (along_x != 0.0 or along_y != 0.0) and not along_x * x + along_y * y > 0.0:
        return math.inf
    cost: float = z / (lumen.length * 0.5 * len(lumen.rest))
    return cost


@compiled
def excess_of(lumen: DistalPathway, family: Family, a: float, b: float, once: bool, scratch: BendWorkspace) -> float:
    """The largest D_i − b_i of (15)-(17) in mm; at most 0 within the bounds. One query evaluation.

    With ``once`` any D_i − b_i above 0 is returned, where there is one.
    """
    bend(lumen.rest, family.plane, a, b, lumen.q_max, scratch.delta, scratch.q)
    snake_frames(scratch.q, lumen.base, lumen.length, scratch.frames)
    return largest_excess(lumen.packed, lumen.blocks, lumen.window, scratch.frames, lumen.bound, once, scratch.work)
