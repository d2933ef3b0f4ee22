"""Inputs of the compiled parts of a step: constants of robot and tool, and the candidate triangles.

Every array that is passed from Python to compiled code costs time, so both are packed and unpacked inside.
``ConstantNumbers`` and ``CandidateNumbers`` define the layouts.
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
    """Constants of a controller; n joints, S segments, B obstacles; mm, rad, s.

    chain, links (n,), reach: the robot; see ``sweep_kernel.acceleration_bound`` for the last two.
    start, end: (S, 3) the tool's segments in the tip frame; radius: (S,).
    lower, upper, speed, acceleration: (n,) limits of the joints.
    shapes: obstacles with analytic shapes, which come after those with surfaces.
    margin: (B,) of every obstacle; buffered_margin: (B,) margin plus buffer, enforced by the rows of the QP.
    threshold: largest distance of pairs; change: approach deceleration · dt², see ``stopping.approach_bound``.
    regularisation: (n + 1, n + 1) WᵀW of the joint regularisation, an objective of every step.
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
    buffered_margin: Array
    threshold: float
    change: float
    dt: float
    regularisation: Array


class ConstantNumbers(NamedTuple):
    """Layout of the packed floats; n joints, s segments, b obstacles, z of them shapes."""

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
    buffered_margin: Annotated[Array, "b"]
    regularisation: Annotated[Array, "n + 1", "n + 1"]
    shapes: Annotated[Array, "z", DATA_WIDTH]


class ConstantCounts(NamedTuple):
    """Layout of the packed integers: n, s, b and z, then the joints' kinds and the shapes' kinds."""

    sizes: Annotated[IntArray, 4]
    revolute: Annotated[IntArray, "n"]
    shape: Annotated[IntArray, "z"]


NUMBERS = packing(ConstantNumbers, "n", "s", "b", "z")
COUNTS = packing(ConstantCounts, "n", "z")
_number_views, _count_views = NUMBERS.views, COUNTS.views


class CandidateTriangles(NamedTuple):
    """Triangles of M surfaces near the tool, see ``Candidates``, and the poses for which they are complete.

    boxes, corners, label: of all surfaces; frame: (M, 4).
    first: (M, S + 1) nodes, segment s of surface m owns first[m, s] to first[m, s + 1].
    start, end: (S, 3) the tool's pose when they were gathered; slack: allowed displacement from there, mm.
    """

    boxes: Float32Array
    corners: Array
    label: Int32Array
    frame: Array
    first: Int32Array
    start: Array
    end: Array
    slack: float


class CandidateNumbers(NamedTuple):
    """Layout of the small packed arrays of the candidates; s segments, k surfaces."""

    slack: Annotated[float, ()]
    start: Annotated[Array, "s", 3]
    end: Annotated[Array, "s", 3]
    frame: Annotated[Array, "k", 4]


CANDIDATES = packing(CandidateNumbers, "s", "k")
_candidate_views = CANDIDATES.views


class PackedConstants(NamedTuple):
    """The constants in two arrays: ``ConstantNumbers`` and ``ConstantCounts``."""

    numbers: Array
    counts: IntArray


def pack_constants(c: StepConstants) -> PackedConstants:
    """Pack the constants for the kernels."""
    chain = c.chain
    numbers = ConstantNumbers(
        c.reach, c.threshold, c.change, c.dt,
        chain.axis, chain.rotation, chain.offset, chain.tip_rotation, chain.tip_offset,
        c.links, c.lower, c.upper, c.speed, c.acceleration,
        c.start, c.end, c.radius, c.margin, c.buffered_margin, c.regularisation, c.shapes.data,
    )  # fmt: skip
    sizes = (len(c.lower), len(c.radius), len(c.margin), len(c.shapes.kind))
    counts = np.concatenate([sizes, chain.revolute, c.shapes.kind]).astype(np.int64)
    return PackedConstants(packed(numbers), counts)


def pack_candidates(slack: float, start: Array, end: Array, frame: Array) -> Array:
    """Pack the small arrays of the candidates: slack, start (S, 3), end (S, 3), frame (M, 4)."""
    return packed(CandidateNumbers(slack, start, end, frame))


@shared
def unpack_constants(numbers: Array, counts: IntArray) -> StepConstants:
    """Return views of packed constants."""
    n, s, b, z = counts[0], counts[1], counts[2], counts[3]
    w, kinds = _number_views(numbers, n, s, b, z), _count_views(counts, n, z)
    chain = Chain(kinds.revolute, w.axis, w.rotation, w.offset, w.tip_rotation, w.tip_offset)
    return StepConstants(
        chain, w.links, w.reach, w.start, w.end, w.radius, w.lower, w.upper, w.speed, w.acceleration,
        ShapeTable(kinds.shape, w.shapes), w.margin, w.buffered_margin, w.threshold, w.change, w.dt, w.regularisation,
    )  # fmt: skip


@shared
def unpack_candidates(
    segments: int, boxes: Float32Array, corners: Array, label: Int32Array, first: Int32Array, numbers: Array
) -> CandidateTriangles:
    """Build the candidates from their arrays, of which the small ones are packed by ``pack_candidates``."""
    c = _candidate_views(numbers, segments, len(first))
    return CandidateTriangles(boxes, corners, label, c.frame, first, c.start, c.end, c.slack)
