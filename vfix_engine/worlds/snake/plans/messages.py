"""What takes longer than a tick of a driven snake, as plain values: what a planner is asked, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ....arrays import Array, IntArray
from ....geometry.curve import Curve
from ....pathway.limits.link_bounds import LinkBounds
from ....snake.bending.optimise import DistalBend
from ....snake.conform.conformance import ShapeSolution


class PlannedShape(NamedTuple):
    """A ``ShapeSolution`` without its curve, which stays where it is."""

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
    """Where the distal links are, for which control bends are wanted.

    t: of the pathway in s; base: (4, 4) of the frame that they hang on; rest: (2L',) their part of the conforming
    shape; window: (L', 2); bound: (L',) mm. tip_s: of the robot, mm.
    """

    t: float
    base: Array
    rest: Array
    window: IntArray
    bound: Array
    tip_s: float


@dataclass(frozen=True, eq=False)
class LookWanted:
    """From where the view is to be turned on towards a side.

    at: where the distal links are; q: (2L',) rad, their joints; side: 0 … 7, see ``look_plan``.
    aim: rad, where a path ends.
    """

    at: BendsWanted
    q: Array
    side: int
    aim: float


class LookPart(NamedTuple):
    """A piece of a path towards a side, from the bend ``start`` (2L',) rad off the conforming shape.

    bends: on from there; ends: in words, what ends the path behind them, '' where it goes on.
    """

    side: int
    start: Array
    bends: tuple[tuple[float, ...], ...]
    ends: str


@dataclass(frozen=True, eq=False)
class PlanInputs:
    """What is wanted of a planner; at least one of four.

    t: the time in s at which the tissue is to be looked at, None: not now.
    near: the shape that the robot has or is about to have, with its tip at ``tip_s`` mm; ``most``: rad, by which the
        shape that follows the tissue may differ from it.
    sign: of the insertion whose next shapes are wanted, 0: none are. spacing_mm: between two of them.
    bend: (2L,) rad by which the hand has bent the robot off that shape. bounds: that planned shapes keep where the link
        is inside, less a reserve (L,) mm; the shape that follows the tissue keeps them with that bend.
    bends: where control bends are wanted, or None. view: from where the view is to be turned on, or None.
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

    centre, tangent, first (C, 3) and radius (C, A): the contours that the pathway is packed of; they are a sixth of its
    size, and every adoption is recorded. length_mm: of the curve. rim_mm_per_s: (S,), how fast the wall of each segment
    moves at most.
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
    """A planner's answer; what was not asked for is None or empty.

    seen: the tissue; lost: in words, why the tissue leaves no pathway.
    near: the shape that ``ahead`` begins at: tips and shapes of an insertion in the direction ``sign``.
    bends: control bends at the place where they were ``wanted``. view: on towards a side.
    """

    seen: ShapeAtTime | None
    lost: str | None
    near: PlannedShape
    sign: int
    ahead: tuple[PlannedShape, ...]
    bends: tuple[DistalBend, ...]
    wanted: BendsWanted | None
    view: LookPart | None = None
