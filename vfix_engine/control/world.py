"""What the compiled parts of a step are told: the robot's and tool's fixed numbers, and the triangles kept near.

Every array that Python hands to compiled code costs time, so both travel packed and are unpacked inside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import compiled
from ..geometry.shapes import DATA_WIDTH, ShapeTable
from ..robots.chain_kernel import Chain

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]
Counts = NDArray[np.int64]


class World(NamedTuple):
    """All that stays the same during a controller's life; n joints, S segments, B bodies; mm, rad, s.

    chain, links (n,), reach: the robot; see ``sweep_kernel.bend`` for the last two.
    start, end: (S, 3) the tool's segments in the tip frame; radius: (S,).
    lower, upper, speed, acceleration: (n,) limits of the joints.
    shapes: the analytic bodies, which come after those that are surfaces.
    margin: (B,) of every body; keep: (B,) margin and buffer, what the rows of the QP keep.
    threshold: pairs are looked for up to here; change: approach deceleration · dt², see ``boundary.approach_room``.
    """

    chain: Chain
    links: Array
    reach: float
    start: Array
    end: Array
    radius: Array
    lower: Array
    upper: Array
    speed: Array
    acceleration: Array
    shapes: ShapeTable
    margin: Array
    keep: Array
    threshold: float
    change: float
    dt: float


class Cover(NamedTuple):
    """Triangles of M surfaces near the tool, see ``Candidates``, and the poses for which nothing else can matter.

    boxes, corners, label: of all surfaces; frame: (M, 4).
    first: (M, S + 1) nodes, segment s of surface m owns first[m, s] to first[m, s + 1].
    start, end: (S, 3) the tool where they were gathered; slack: how far it may be from there, mm.
    """

    boxes: Single
    corners: Array
    label: Index
    frame: Array
    first: Index
    start: Array
    end: Array
    slack: float


class PackedWorld(NamedTuple):
    """A world in two arrays: all its numbers, and n, S, B, z, the joints' kinds (n,) and the shapes' kinds (z,)."""

    numbers: Array
    counts: Counts


def pack_world(world: World) -> PackedWorld:
    """The world as its kernels take it."""
    chain = world.chain
    arrays = (
        *chain[1:], world.links, world.lower, world.upper, world.speed, world.acceleration,
        world.start, world.end, world.radius, world.margin, world.keep, world.shapes.data,
    )  # fmt: skip
    scalars = np.array([world.reach, world.threshold, world.change, world.dt])
    sizes = (len(world.lower), len(world.radius), len(world.margin), len(world.shapes.kind))
    return PackedWorld(
        np.concatenate([scalars, *(array.ravel() for array in arrays)]),
        np.concatenate([sizes, chain.revolute, world.shapes.kind]).astype(np.int64),
    )


def pack_poses(slack: float, start: Array, end: Array, frame: Array) -> Array:
    """The small arrays of a cover in one: slack, start (S, 3), end (S, 3), frame (M, 4)."""
    return np.concatenate(([slack], start.ravel(), end.ravel(), frame.ravel()))


@compiled
def unpack_world(numbers: Array, counts: Counts) -> World:
    """Views of a packed world."""
    n, s, b, z = counts[0], counts[1], counts[2], counts[3]
    a = 4
    axis = numbers[a : a + 3 * n].reshape(n, 3)
    a += 3 * n
    rotation = numbers[a : a + 9 * n].reshape(n, 3, 3)
    a += 9 * n
    offset = numbers[a : a + 3 * n].reshape(n, 3)
    a += 3 * n
    tip_rotation, tip_offset = numbers[a : a + 9].reshape(3, 3), numbers[a + 9 : a + 12]
    a += 12
    links, lower, upper = numbers[a : a + n], numbers[a + n : a + 2 * n], numbers[a + 2 * n : a + 3 * n]
    speed, acceleration = numbers[a + 3 * n : a + 4 * n], numbers[a + 4 * n : a + 5 * n]
    a += 5 * n
    start, end = numbers[a : a + 3 * s].reshape(s, 3), numbers[a + 3 * s : a + 6 * s].reshape(s, 3)
    radius = numbers[a + 6 * s : a + 7 * s]
    a += 7 * s
    margin, keep = numbers[a : a + b], numbers[a + b : a + 2 * b]
    a += 2 * b
    data = numbers[a : a + DATA_WIDTH * z].reshape(z, DATA_WIDTH)
    chain = Chain(counts[4 : 4 + n] != 0, axis, rotation, offset, tip_rotation, tip_offset)
    return World(
        chain, links, numbers[0], start, end, radius, lower, upper, speed, acceleration,
        ShapeTable(counts[4 + n : 4 + n + z], data), margin, keep, numbers[1], numbers[2], numbers[3],
    )  # fmt: skip


@compiled
def unpack_cover(segments: int, boxes: Single, corners: Array, label: Index, first: Index, numbers: Array) -> Cover:
    """A cover from its arrays, the small ones packed by ``pack_poses``."""
    a, b = 1 + 3 * segments, 1 + 6 * segments
    return Cover(
        boxes, corners, label, numbers[b:].reshape(len(first), 4), first,
        numbers[1:a].reshape(segments, 3), numbers[a:b].reshape(segments, 3), numbers[0],
    )  # fmt: skip
