"""Where an insertion goes next: conforming shapes a waypoint apart, each moved off the wall before it is followed.

Conformance knows joints and a curve and no bounds. A shape that comes nearer to a bound than a reserve is moved off it
while it is planned, and those after it go on from there; so it is not left to the moment in which the robot is there
and one step of its joints would have to do.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace

import numpy as np

from ...arrays import Array, IntArray
from ...geometry.curve import Curve
from ...pathway.packed import PackedPathway
from ...pathway.query.query import Query
from ...robots.snake import SnakeModel
from ..control.projection import projected_to_limits
from ..control.tip_control import DistalContext
from .conformance import Insertion, ShapeSolution, conform

RESERVE_MM = 0.1  # [mm] so much inside of its bound a link is planned to be, half its bound at most
MOST = 0.1  # [rad] that a joint of a planned shape may be moved for it


class Waypoints:
    """The shapes of one insertion, the same however fast it goes.

    Args:
        curve: what the snake conforms to; slack: (N,) mm about its points; tip_s: where the tip begins.
        still: whether the curve never moves; then every shape knows those before it.
        spacing_mm: between two shapes.
    """

    def __init__(
        self, snake: SnakeModel, curve: Curve, slack: Array | None, tip_s: float, still: bool, spacing_mm: float
    ) -> None:
        self.curve, self.spacing_mm, self.projected = curve, spacing_mm, 0
        self._snake, self._slack, self._still = snake, slack, still
        self._insertion = Insertion(snake, curve, slack, None, tip_s, snake.reach_mm())
        self._last = self.first = self._insertion.state
        self._ahead: tuple[float, ShapeSolution] | None = None

    def copy(self) -> Waypoints:
        """Waypoints that go on by themselves."""
        other = copy(self)
        other._insertion = copy(self._insertion)
        return other

    def ahead(self, tip_s: float, sign: float) -> tuple[float, ShapeSolution, bool]:
        """The next place, its shape and whether that is new, from ``tip_s`` on forwards or, with −1, backwards.

        Raises:
            LookupError: there is none, the tip is at an end.
        """
        if self._ahead is not None and (self._ahead[0] - tip_s) * sign > 0.0:
            return *self._ahead, False
        place = tip_s + sign * self.spacing_mm
        place = min(place, self.curve.length) if sign > 0.0 else max(place, 0.0)
        if (place - tip_s) * sign <= 0.0:
            raise LookupError("the end of the path" if sign > 0.0 else "the robot is out")
        shape = self._insertion.advance(place - self._insertion.tip_s) if self._still else self.at(place, self._last)
        self._ahead = (place, shape)
        return place, shape, True

    def correct(self, shape: ShapeSolution) -> None:
        """Take a better shape for the place ahead."""
        assert self._ahead is not None
        self._ahead = (self._ahead[0], shape)
        if self._still:
            self._insertion.correct(shape)
        self.projected += 1

    def passed(self) -> None:
        """The shape ahead has been taken."""
        if self._ahead is not None:
            self._last, self._ahead = self._ahead[1], None

    def restart(self, shape: ShapeSolution) -> None:
        """Plan anew from another shape, what was ahead is let go."""
        self._last, self._ahead = shape, None
        if self._still:
            self._insertion.correct(shape)

    def at(self, tip_s: float, near: ShapeSolution, most: float = math.inf) -> ShapeSolution:
        """The shape that conforms to the curve as it is now, no angle ``most`` rad from that of before."""
        return conform(self._snake, self.curve, tip_s, near, self._slack, self._insertion.roll, most=most)


def moved_off(
    shape: ShapeSolution, snake: SnakeModel, query: Query, packed: PackedPathway, windows: IntArray, bound: Array
) -> ShapeSolution | None:
    """A shape that keeps its bounds (L,) mm, near one that does not or hardly; None where it does, or none is found.

    windows: (L, 2) segments that the links are measured against.
    """
    kept = bound - np.minimum(RESERVE_MM, 0.5 * bound)
    depth = query.deviations(packed, snake.frames(shape.q, shape.base), windows).depth
    if (depth <= kept).all():
        return None
    q = projected_to_limits(DistalContext(snake, query, shape.base, shape.q, packed, windows, kept), shape.q, MOST)
    if q is None or (query.deviations(packed, snake.frames(q, shape.base), windows).depth > bound).any():
        return None
    return replace(shape, q=q, exact=False)
