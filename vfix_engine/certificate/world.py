"""What the compiled parts of a step take: the robot's and tool's fixed numbers, and the triangles kept near.

Every array that Python hands to compiled code costs time, so both travel packed and are unpacked inside.
``WorldNumbers`` and ``CoverNumbers`` are the tables of their fields.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from ..arrays import Array, Float32Array, Int32Array, IntArray
from ..geometry.shapes import DATA_WIDTH, ShapeTable
from ..kernels.compiled import shared
from ..kernels.packed import packed, packing
from ..robots.chain_kernel import Chain


class StepConstants(NamedTuple):
    """All that stays the same during a controller's life; n joints, S segments, B bodies; mm, rad, s.

    chain, links (n,), reach: the robot; see ``sweep_kernel.bend`` for the last two.
    start, end: (S, 3) the tool's segments in the tip frame; radius: (S,).
    lower, upper, speed, acceleration: (n,) limits of the joints.
    shapes: the analytic bodies, which come after those that are surfaces.
    margin: (B,) of every body; keep: (B,) margin and buffer, what the rows of the QP keep.
    threshold: pairs are looked for up to here; change: approach deceleration · dt², see ``stopping.approach_bound``.
    regularisation: (n + 1, n + 1) WᵀW of the joint regularisation, an objective that every step has.
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
    regularisation: Array


class WorldNumbers(NamedTuple):
    """The numbers of a world as they are packed; n joints, s segments, b bodies, z of them shapes."""

    reach: Annotated[float, ()]
    threshold: Annotated[float, ()]
    change: Annotated[float, ()]
    dt: Annotated[float, ()]
    axis: Annotated[Array, "n", 3]
    rotation: Annotated[Array, "n", 3, 3]
    offset: Annotated[Array, "n", 3]
    tip_rotation: Annotated[Array, 3, 3]
    tip_offset: Annotated[Array, 3]
    links: Annotated[Array, "n"]
    lower: Annotated[Array, "n"]
    upper: Annotated[Array, "n"]
    speed: Annotated[Array, "n"]
    acceleration: Annotated[Array, "n"]
    start: Annotated[Array, "s", 3]
    end: Annotated[Array, "s", 3]
    radius: Annotated[Array, "s"]
    margin: Annotated[Array, "b"]
    keep: Annotated[Array, "b"]
    regularisation: Annotated[Array, "n + 1", "n + 1"]
    shapes: Annotated[Array, "z", DATA_WIDTH]


class WorldKinds(NamedTuple):
    """The whole numbers of a world: n, s, b and z, then the joints' kinds and the shapes' kinds."""

    sizes: Annotated[IntArray, 4]
    revolute: Annotated[IntArray, "n"]
    shape: Annotated[IntArray, "z"]


WORLD = packing(WorldNumbers, "n", "s", "b", "z")
KINDS = packing(WorldKinds, "n", "z")
_world_views, _kind_views = WORLD.views, KINDS.views


class Cover(NamedTuple):
    """Triangles of M surfaces near the tool, see ``Candidates``, and the poses for which nothing else can matter.

    boxes, corners, label: of all surfaces; frame: (M, 4).
    first: (M, S + 1) nodes, segment s of surface m owns first[m, s] to first[m, s + 1].
    start, end: (S, 3) the tool where they were gathered; slack: how far it may be from there, mm.
    """

    boxes: Float32Array
    corners: Array
    label: Int32Array
    frame: Array
    first: Int32Array
    start: Array
    end: Array
    slack: float


class CoverNumbers(NamedTuple):
    """The small arrays of a cover as they are packed; s segments, k surfaces."""

    slack: Annotated[float, ()]
    start: Annotated[Array, "s", 3]
    end: Annotated[Array, "s", 3]
    frame: Annotated[Array, "k", 4]


COVER = packing(CoverNumbers, "s", "k")
_cover_views = COVER.views


class PackedWorld(NamedTuple):
    """A world in two arrays: ``WorldNumbers`` and ``WorldKinds``."""

    numbers: Array
    counts: IntArray


def pack_world(world: StepConstants) -> PackedWorld:
    """The world as its kernels take it."""
    chain = world.chain
    numbers = WorldNumbers(
        world.reach, world.threshold, world.change, world.dt,
        chain.axis, chain.rotation, chain.offset, chain.tip_rotation, chain.tip_offset,
        world.links, world.lower, world.upper, world.speed, world.acceleration,
        world.start, world.end, world.radius, world.margin, world.keep, world.regularisation, world.shapes.data,
    )  # fmt: skip
    sizes = (len(world.lower), len(world.radius), len(world.margin), len(world.shapes.kind))
    counts = np.concatenate([sizes, chain.revolute, world.shapes.kind]).astype(np.int64)
    return PackedWorld(packed(numbers), counts)


def pack_poses(slack: float, start: Array, end: Array, frame: Array) -> Array:
    """The small arrays of a cover in one: slack, start (S, 3), end (S, 3), frame (M, 4)."""
    return packed(CoverNumbers(slack, start, end, frame))


@shared
def unpack_world(numbers: Array, counts: IntArray) -> StepConstants:
    """Views of a packed world."""
    n, s, b, z = counts[0], counts[1], counts[2], counts[3]
    w, kinds = _world_views(numbers, n, s, b, z), _kind_views(counts, n, z)
    chain = Chain(kinds.revolute, w.axis, w.rotation, w.offset, w.tip_rotation, w.tip_offset)
    return StepConstants(
        chain, w.links, w.reach, w.start, w.end, w.radius, w.lower, w.upper, w.speed, w.acceleration,
        ShapeTable(kinds.shape, w.shapes), w.margin, w.keep, w.threshold, w.change, w.dt, w.regularisation,
    )  # fmt: skip


@shared
def unpack_cover(
    segments: int, boxes: Float32Array, corners: Array, label: Int32Array, first: Int32Array, numbers: Array
) -> Cover:
    """A cover from its arrays, the small ones packed by ``pack_poses``."""
    c = _cover_views(numbers, segments, len(first))
    return Cover(boxes, corners, label, c.frame, first, c.start, c.end, c.slack)
