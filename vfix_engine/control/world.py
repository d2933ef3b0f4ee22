"""What the compiled parts of a step are told: the robot's and tool's fixed numbers, and the triangles kept near.

Every array that Python hands to compiled code costs time, so both travel packed and are unpacked inside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import shared
from ..geometry.shapes import DATA_WIDTH, ShapeTable
from ..geometry.views import view
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


@shared
def unpack_world(numbers: Array, counts: Counts) -> World:
    """Views of a packed world."""
    n, s, b, z = counts[0], counts[1], counts[2], counts[3]
    axis, rotation, offset, tip = 4, 4 + 3 * n, 4 + 12 * n, 4 + 15 * n  # the scalars come first
    links = tip + 12
    start, shapes = links + 5 * n, links + 5 * n + 7 * s + 2 * b
    chain = Chain(
        view(counts, 4, (n,)), view(numbers, axis, (n, 3)), view(numbers, rotation, (n, 3, 3)),
        view(numbers, offset, (n, 3)), view(numbers, tip, (3, 3)), view(numbers, tip + 9, (3,)),
    )  # fmt: skip
    return World(
        chain, view(numbers, links, (n,)), numbers[0],
        view(numbers, start, (s, 3)), view(numbers, start + 3 * s, (s, 3)), view(numbers, start + 6 * s, (s,)),
        view(numbers, links + n, (n,)), view(numbers, links + 2 * n, (n,)),
        view(numbers, links + 3 * n, (n,)), view(numbers, links + 4 * n, (n,)),
        ShapeTable(view(counts, 4 + n, (z,)), view(numbers, shapes, (z, DATA_WIDTH))),
        view(numbers, start + 7 * s, (b,)), view(numbers, start + 7 * s + b, (b,)),
        numbers[1], numbers[2], numbers[3],
    )  # fmt: skip


@shared
def unpack_cover(segments: int, boxes: Single, corners: Array, label: Index, first: Index, numbers: Array) -> Cover:
    """A cover from its arrays, the small ones packed by ``pack_poses``."""
    a, b = 1 + 3 * segments, 1 + 6 * segments
    return Cover(
        boxes, corners, label, view(numbers, b, (len(first), 4)), first,
        view(numbers, 1, (segments, 3)), view(numbers, a, (segments, 3)), numbers[0],
    )  # fmt: skip
