"""The surface of an inspection cone: from a target towards the tails of tools that can inspect it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, IndexArray
from ...validate import point
from .inspection_cone import DIRECTIONS, InspectionCone, spread_directions

_SIDES = 16  # of the round cone that represents directions without an area between them


def cone_surface(cone: InspectionCone, target: ArrayLike, length_mm: float) -> tuple[Array, IndexArray]:
    """Vertices (n, 3) and faces (m, 3) of the cone with the actual extent of its directions; none for an empty one.

    The directions form triangles with their neighbours on the sphere. A triangle whose three corners are
    in the cone is a part of the cap, ``length_mm`` from the target, and its free edges are joined to the target:
    the surface is within the directions that were found. Where these span no triangle, a round cone of their solid
    angle about their mean represents them.

    Args:
        target: (3,) LPS mm, the apex.
    """
    apex = point("the target", target)
    if not len(cone.directions):
        return np.zeros((0, 3)), np.zeros((0, 3), np.intp)
    every, triangles = _net()
    found = np.zeros(DIRECTIONS, bool)
    found[(cone.directions @ every.T).argmax(axis=1)] = True
    cap = triangles[found[triangles].all(axis=1)]
    if not len(cap):
        return _round_cone(cone, apex, length_mm)
    edges = np.sort(np.concatenate([cap[:, [0, 1]], cap[:, [1, 2]], cap[:, [2, 0]]]), axis=1)
    border, count = np.unique(edges, axis=0, return_counts=True)
    border = border[count == 1]
    used, where = np.unique(np.concatenate([cap.ravel(), border.ravel()]), return_inverse=True)
    vertices = np.vstack([apex, apex - length_mm * every[used]])
    faces, sides = where[: cap.size].reshape(-1, 3) + 1, where[cap.size :].reshape(-1, 2) + 1
    return vertices, np.vstack([faces, np.column_stack([np.zeros(len(sides), np.intp), sides])])


def mean_direction(cone: InspectionCone) -> Array:
    """Unit vector (3,) from the tip towards the tail, in the middle of the cone's directions; NaN for an empty one."""
    if not len(cone.directions):
        return np.full(3, np.nan)
    mean = -cone.directions.mean(axis=0)
    length = float(np.linalg.norm(mean))
    unit: Array = mean / length if length > 1e-9 else -cone.directions[0]
    return unit


def _round_cone(cone: InspectionCone, apex: Array, length_mm: float) -> tuple[Array, IndexArray]:
    axis = mean_direction(cone)
    side = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    side /= np.linalg.norm(side)
    half, turns = np.radians(0.5 * cone.cone_deg), np.arange(_SIDES) * 2.0 * np.pi / _SIDES
    across = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * np.cross(axis, side)
    rim = apex + length_mm * (np.cos(half) * axis + np.sin(half) * across)
    around = np.arange(_SIDES)
    faces = np.column_stack([np.zeros(_SIDES, np.intp), 1 + around, 1 + (around + 1) % _SIDES])
    return np.vstack([apex, rim]), faces


@lru_cache(maxsize=1)
def _net() -> tuple[Array, IndexArray]:
    """The directions (DIRECTIONS, 3), and the triangles (T, 3) that they form with their neighbours."""
    from scipy.spatial import ConvexHull  # imported here: slow to load

    every = spread_directions()
    return every, np.asarray(ConvexHull(every).simplices, dtype=np.intp)
