"""Picking: what a click hits among bone and skin (without the half that is cut away), CT planes and points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh

Cut = Literal["whole", "left", "right"]


@dataclass(frozen=True)
class Hit:
    """The nearest hit of a ray, LPS mm. kind: what was hit; item_id only for 'item'.

    position: for 'skin' the place in the air before it.
    """

    kind: Literal["bone", "skin", "slice", "item"]
    position: Array
    distance_mm: float
    item_id: str | None = None


@dataclass(frozen=True)
class PickingPlane:
    """A CT slice in the scene: the axis of its normal, its position on that axis in LPS mm, and its extent."""

    axis: int
    position: float
    bounds: Array  # (2, 3) LPS [mm]


def is_shown(points: Array, cut: Cut, cut_at: float) -> npt.NDArray[np.bool_]:
    """Return for points (n, 3) whether they are in the shown part of the head."""
    if cut == "left":
        return np.asarray(points[:, 0] <= cut_at)
    if cut == "right":
        return np.asarray(points[:, 0] >= cut_at)
    return np.ones(len(points), dtype=bool)


class SurfacePicker:
    """Intersects rays with a surface by Embree.

    before_mm: distance of a hit's position from the surface, on the side of its normals.
    """

    def __init__(self, mesh: TriangleMesh, kind: Literal["bone", "skin"] = "bone", before_mm: float = 0.0) -> None:
        surface = trimesh.Trimesh(vertices=mesh.vertices, faces=mesh.faces, process=False, validate=False)
        self._intersector = RayMeshIntersector(surface)
        self._mesh, self._kind, self._before_mm = mesh, kind, before_mm

    def hit(self, origin: Array, direction: Array, cut: Cut, cut_at: float) -> Hit | None:
        locations, _, faces = self._intersector.intersects_location(
            origin[None], direction[None], multiple_hits=cut != "whole"
        )
        locations = np.asarray(locations, dtype=np.float64).reshape(-1, 3)
        if cut != "whole":
            shown = is_shown(locations, cut, cut_at)
            locations, faces = locations[shown], faces[shown]
        if len(locations) == 0:
            return None
        distance = (locations - origin) @ direction
        nearest = int(distance.argmin())
        position = locations[nearest]
        if self._before_mm:
            a, b, c = self._mesh.vertices[self._mesh.faces[faces[nearest]]]
            normal = np.cross(b - a, c - a)
            position = position + self._before_mm * normal / np.linalg.norm(normal)
        return Hit(self._kind, position, float(distance[nearest]))


def hit_plane(origin: Array, direction: Array, plane: PickingPlane) -> Hit | None:
    if abs(direction[plane.axis]) < 1e-9:
        return None
    distance = (plane.position - origin[plane.axis]) / direction[plane.axis]
    if distance <= 0.0:
        return None
    position = origin + distance * direction
    others = [axis for axis in range(3) if axis != plane.axis]
    inside = np.all(position[others] >= plane.bounds[0][others]) and np.all(position[others] <= plane.bounds[1][others])
    return Hit("slice", position, float(distance)) if inside else None


def hit_items(origin: Array, direction: Array, items: list[tuple[str, Array]], radius_mm: float) -> Hit | None:
    """Return the nearest item whose ball of ``radius_mm`` is hit by the ray, or None."""
    best: Hit | None = None
    for item_id, centre in items:
        along = float((centre - origin) @ direction)
        aside = float(np.linalg.norm(centre - origin - along * direction))
        if along > 0.0 and aside <= radius_mm and (best is None or along < best.distance_mm):
            best = Hit("item", centre, along, item_id)
    return best
