"""What the compiled parts of a step are told: the robot's and tool's fixed numbers, and the triangles kept near."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..geometry.shapes import ShapeTable
from ..robots.chain_kernel import Chain

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]


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
