"""Requests to a planner and its plans, as plain values: computations longer than a tick of a driven snake."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....arrays import Array, IntArray
from ....geometry.curve import Curve
from ....pathway.limits.link_bounds import LinkBounds
from ....pathway.packed import PackedPathway
from ....runtime.plain import DERIVED
from ....snake.bending.optimise import DistalBend
from ....snake.conform.conformance import ShapeSolution


class PlannedShape(NamedTuple):
    """A ``ShapeSolution`` without its curve, which is not sent."""

    base: Array
    q: Array
    joint_s: Array
    offset_mm: Array
    at_limit: NDArray[np.bool_]
    exact: bool
    tip_s: float
    roll: float

    @classmethod
    def of(cls, found: ShapeSolution) -> PlannedShape:
        """The shape alone."""
        return cls(
            found.base, found.q, found.joint_s, found.offset_mm, found.at_limit, found.exact, found.tip_s, found.roll
        )

    def on(self, curve: Curve) -> ShapeSolution:
        """The shape along a curve."""
        return ShapeSolution(*self, curve)

    def same(self, other: ShapeSolution) -> bool:
        """Whether it is the shape of ``other``, bit by bit."""
        return self.tip_s == other.tip_s and np.array_equal(self.q, other.q)


@dataclass(frozen=True, eq=False)
class BendsWanted:
    """The position of the distal links for a request of control bends.

    t: of the pathway in s; base: (4, 4) of the frame that they are attached to; rest: (2L',) their part of the
    conforming shape; window: (L', 2); bound: (L',) mm. tip_s: of the robot, mm.
    """

    t: float
    base: Array
    rest: Array
    window: IntArray
    bound: Array
    tip_s: float


@dataclass(frozen=True, eq=False)
class LookWanted:
    """The start of a request to turn the view further in a direction.

    at: position of the distal links; q: (2L',) rad, their joints; side: 0 … 7, see ``look_plan``.
    aim: rad, where a path ends.
    """

    at: BendsWanted
    q: Array
    side: int
    aim: float


class LookPart(NamedTuple):
    """A piece of a path in a direction, from the bend ``start`` (2L',) rad off the conforming shape.

    bends: the following ones; ends: the reason why the path ends after them, '' where it continues.
    """

    side: int
    start: Array
    bends: tuple[tuple[float, ...], ...]
    ends: str


@dataclass(frozen=True, eq=False)
class PlanInputs:
    """A request to a planner, of at least one of four parts.

    t: time in s at which the tissue is to be sampled, None: not requested.
    near: the robot's present or next shape, with its tip at ``tip_s`` mm; ``most``: rad, by which the
        shape that follows the tissue may differ from it.
    sign: of the insertion whose next shapes are requested, 0: none. spacing_mm: between two of them.
    bend: (2L,) rad, the hand's bend relative to that shape, zeros where no bound holds it. bounds: kept by planned
        shapes where the link is inside, less a reserve (L,) mm; the shape that follows the tissue keeps them including
        that bend.
    bends: position of the requested control bends, or None. view: start of a requested turn of the view, or None.
    """

    t: float | None
    near: PlannedShape
    tip_s: float
    most: float
    sign: int
    spacing_mm: float
    bend: Array
    bounds: LinkBounds
    reserve: Array
    bends: BendsWanted | None
    view: LookWanted | None = None


class ShapeAtTime(NamedTuple):
    """The tissue at the time ``t`` in s, and the shape of the robot that conforms to it.

    centre, tangent, first (C, 3) and radius (C, A): the contours from which the pathway is packed; they are a sixth of
    its size, and every adoption is recorded. length_mm: of the curve. rim_mm_per_s: (S,), how fast the wall of each
    segment moves at most.
    """

    t: float
    centre: Array
    tangent: Array
    first: Array
    radius: Array
    length_mm: float
    goal: PlannedShape
    rim_mm_per_s: Array


@dataclass(frozen=True, eq=False)
class PlannerAnswer:
    """A planner's answer; parts that were not requested are None or empty.

    seen: the tissue; lost: the reason why there is no valid pathway.
    near: the shape at which ``ahead`` begins, the tips and shapes of an insertion in the direction ``sign``.
    bends: control bends at the requested position ``wanted``. view: the next piece in a direction.
    packed: the pathway of ``seen``, so that no tick has to pack it; a recorded answer lacks it.
    """

    seen: ShapeAtTime | None
    lost: str | None
    near: PlannedShape
    sign: int
    ahead: tuple[PlannedShape, ...]
    bends: tuple[DistalBend, ...]
    wanted: BendsWanted | None
    view: LookPart | None = None
    packed: PackedPathway | None = field(default=None, metadata=DERIVED)
