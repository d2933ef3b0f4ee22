"""Polyps are placed: one in each tenth of the way, drawn by a seed among the places that a robot can view."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...validate import whole
from ...worlds.snake.viewing import WallSight
from .printed import POLYPS
from .task import Polyp, PolypTask, checked_place

_APART_MM = 25.0  # along the lumen between two polyps where there is room: one is within the tolerances at a time


@dataclass(frozen=True, eq=False)
class WallPlaces:
    """A lumen's triangles as places where a polyp could be, LPS mm at rest.

    wall: with centroids, normals into the lumen and areas (F,). s: (F,) arc length along the curve that the robot
    follows; axis: (F, 3) the curve there.
    """

    wall: WallSight
    s: Array
    axis: Array

    @classmethod
    def of(cls, mesh: TriangleMesh, curve: Curve) -> Self:
        """Every triangle of a consistently oriented surface. Raises PathwayError for a curve outside of it."""
        wall = WallSight(mesh, curve)
        s = wall.arc_lengths(curve)
        return cls(wall, s, curve.position(s))

    def between(self, from_mm: float, to_mm: float) -> BoolArray:
        """(F,) the places in a part of the way."""
        return (self.s >= from_mm) & (self.s < to_mm)

    def share(self, some: BoolArray, of: BoolArray) -> float:
        """The part, by area, that some of the places are of others (F,)."""
        return float(self.wall.area[some & of].sum() / self.wall.area[of].sum())

    def polyp(self, index: int) -> Polyp:
        """A polyp in the middle of one of the triangles."""
        wall = self.wall
        middle, normal, axis = (checked_place(values[index]) for values in (wall.centre, wall.inward, self.axis))
        return Polyp(float(self.s[index]), middle, normal, axis)


def placed(
    places: WallPlaces,
    viewable: BoolArray,
    from_mm: float,
    end_mm: float,
    end_name: str | None = None,
    seed: int = 0,
    count: int = POLYPS,
) -> PolypTask:
    """Draw one polyp in each of ``count`` equal parts of the way from ``from_mm`` to the end of the task at ``end_mm``.

    In a part every viewable place is drawn with a probability by its area, so all sides of the lumen are.

    Args:
        viewable: (F,) which of the places the robot can view; the others are not drawn. end_name: of the landmark at
            the end, if there is one.

    Raises:
        InputError: a part of the way without a place that can be viewed; a seed that is no whole number from 0.
    """
    rng = np.random.default_rng(whole("the seed", seed, 0))
    edges = np.linspace(from_mm, end_mm, whole("the number of polyps", count, 1) + 1)
    drawn: list[int] = []
    for low, high in pairwise(edges.tolist()):
        apart = places.s[drawn[-1]] + _APART_MM if drawn else -np.inf
        here = np.flatnonzero(viewable & places.between(low, high))
        free = here[places.s[here] >= apart]
        here = free if len(free) else here
        if not len(here):
            raise InputError(
                f"between {low:.0f} and {high:.0f} mm along the lumen this robot can view no place of its wall: a "
                "smaller robot, other bounds or another part of the lumen may have some in every part of the way"
            )
        weight = places.wall.area[here]
        drawn.append(int(rng.choice(here, p=weight / weight.sum())))
    share = places.share(viewable, places.between(from_mm, end_mm))
    polyps = tuple(places.polyp(index) for index in drawn)
    return PolypTask(polyps, float(from_mm), float(end_mm), end_name, seed, share)
