"""Polyps are placed: one in each tenth of the way, drawn by a seed among the places that a robot can view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...anatomy.lumen.wall import Wall, outward_side
from ...arrays import Array, BoolArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...geometry.transport import transported
from ...proximity.proximity import ProximityTree
from ...validate import whole
from .task import Polyp, PolypTask, checked_place

POLYPS = 10  # as printed
_EVERY_MM, _SIDES = 5.0, 24  # between two places along the curve, and places round it
_APART_MM = (
    25.0  # along the curve between two polyps where there is room, so that one is within the tolerances at a time
)


@dataclass(frozen=True, eq=False)
class WallPlaces:
    """Places on a lumen's wall where a polyp could be, LPS mm at rest.

    s: (n,) mm, arc length along the curve; azimuth: (n,) rad about it, from a frame that is parallel transported along
    the curve. axis, wall, normal: (n, 3) the point of the curve, where the ray from there across it meets the wall, and
    the unit normal there into the lumen.
    """

    s: Array
    azimuth: Array
    axis: Array
    wall: Array
    normal: Array

    @classmethod
    def between(cls, mesh: TriangleMesh, curve: Curve, from_mm: float, to_mm: float) -> WallPlaces:
        """Every 5 mm along a curve and every 15° about it.

        Raises:
            InputError: a range of no length. PathwayError: a curve that does not lie in the surface.
        """
        if not 0.0 <= from_mm < to_mm:
            raise InputError(f"there is no place for polyps from {from_mm:.0f} to {to_mm:.0f} mm")
        s = np.arange(from_mm, to_mm, _EVERY_MM)
        angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        tangent = curve.tangent(s)
        index = np.clip(np.round(s / curve.step_mm).astype(np.int64), 0, len(curve.points) - 1)
        first = transported(curve.points, curve.tangents)[index]
        first -= np.einsum("ij,ij->i", first, tangent)[:, None] * tangent
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(tangent, first)
        rays = np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None]
        axis = np.broadcast_to(curve.position(s)[:, None], rays.shape)
        return cls._met(Wall(mesh), np.repeat(s, _SIDES), np.tile(angles, len(s)), axis.reshape(-1, 3), rays)

    @classmethod
    def _met(cls, wall: Wall, s: Array, azimuth: Array, axis: Array, rays: Array) -> WallPlaces:
        """Where rays meet the wall from inside, with its normal there."""
        flat = rays.reshape(-1, 3)
        distance, side = wall.seen(axis, flat)
        met = (side == outward_side(side)) & np.isfinite(distance)
        s, azimuth, axis, flat = s[met], azimuth[met], axis[met], flat[met]
        points = axis + distance[met][:, None] * flat
        triangle = ProximityTree(wall.mesh).point_distance(points)[2]
        normal = wall.mesh.face_normals[triangle]
        facing = np.einsum("ij,ij->i", normal, flat)
        return cls(s, azimuth, axis, points, np.where(facing[:, None] < 0.0, normal, -normal))

    def polyp(self, index: int) -> Polyp:
        """A polyp at one of the places."""
        wall, normal, axis = (checked_place(values[index]) for values in (self.wall, self.normal, self.axis))
        return Polyp(float(self.s[index]), float(np.degrees(self.azimuth[index])), wall, normal, axis)


Viewable = Callable[[WallPlaces], BoolArray]
"""(n,) which of some places a robot can view."""


def placed(
    places: WallPlaces,
    viewable: BoolArray,
    from_mm: float,
    to_mm: float,
    end_mm: float,
    end_name: str | None,
    seed: int,
    count: int = POLYPS,
) -> PolypTask:
    """Draw one polyp in each of ``count`` equal parts of the way from ``from_mm`` to ``to_mm``.

    Args:
        viewable: (n,) which of the places the robot can view; the others are not drawn.

    Raises:
        InputError: a part of the way without a place that can be viewed; a seed that is no whole number from 0.
    """
    rng = np.random.default_rng(whole("the seed", seed, 0))
    edges = np.linspace(from_mm, to_mm, whole("the number of polyps", count, 1) + 1)
    drawn: list[int] = []
    for low, high in pairwise(edges.tolist()):
        apart = places.s[drawn[-1]] + _APART_MM if drawn else -np.inf
        here = np.flatnonzero(viewable & (places.s >= low) & (places.s < high))
        free = here[places.s[here] >= apart]
        if not len(here):
            raise InputError(
                f"between {low:.0f} and {high:.0f} mm along the lumen this robot can view no place of its wall: a "
                "smaller robot, other bounds or another part of the lumen may have some in every part of the way"
            )
        drawn.append(int(rng.choice(free if len(free) else here)))
    polyps = tuple(places.polyp(index) for index in drawn)
    return PolypTask(polyps, float(end_mm), end_name, seed, float(np.mean(viewable)))
