"""Polyps are placed: one in each tenth of the way, drawn by a seed among the places that a robot can view."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...validate import whole
from .task import Polyp, PolypTask, checked_place

POLYPS = 10  # as printed
_APART_MM = 25.0  # along the lumen between two polyps where there is room: one is within the tolerances at a time


@dataclass(frozen=True, eq=False)
class WallPlaces:
    """A lumen's triangles as places where a polyp could be, LPS mm at rest.

    middle, normal: (F, 3) centroids, and unit normals into the lumen. area: (F,) mm². s: (F,) arc length along the
    curve that the robot follows; axis: (F, 3) the curve there.
    """

    middle: Array
    normal: Array
    area: Array
    s: Array
    axis: Array

    @classmethod
    def of(cls, mesh: TriangleMesh, curve: Curve, s: Array | None = None) -> Self:
        """Every triangle of a consistently oriented surface.

        s: (F,) of the triangles; None: that of the nearest point of the curve.
        """
        middle = mesh.triangles.mean(axis=1)
        if s is None:
            s = curve.step_mm * cKDTree(curve.points).query(middle)[1].astype(np.float64)
        axis, area = curve.position(s), _areas(mesh)
        inwards = np.einsum("ij,ij->i", mesh.face_normals, axis - middle)
        sign = 1.0 if float(area @ np.sign(inwards)) > 0.0 else -1.0
        return cls(middle, sign * mesh.face_normals, area, s, axis)

    def polyp(self, index: int) -> Polyp:
        """A polyp in the middle of one of the triangles."""
        middle, normal, axis = (checked_place(values[index]) for values in (self.middle, self.normal, self.axis))
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
        here = np.flatnonzero(viewable & (places.s >= low) & (places.s < high))
        free = here[places.s[here] >= apart]
        here = free if len(free) else here
        if not len(here):
            raise InputError(
                f"between {low:.0f} and {high:.0f} mm along the lumen this robot can view no place of its wall: a "
                "smaller robot, other bounds or another part of the lumen may have some in every part of the way"
            )
        weight = places.area[here]
        drawn.append(int(rng.choice(here, p=weight / weight.sum())))
    way = (places.s >= from_mm) & (places.s < end_mm)
    share = float(places.area[way & viewable].sum() / places.area[way].sum())
    polyps = tuple(places.polyp(index) for index in drawn)
    return PolypTask(polyps, float(from_mm), float(end_mm), end_name, seed, share)


def _areas(mesh: TriangleMesh) -> Array:
    one, two, three = np.moveaxis(mesh.triangles, 1, 0)
    area: Array = 0.5 * np.linalg.norm(np.cross(two - one, three - one), axis=1)
    return area
