"""Planned bone removal: the surface without the bone inside regions, and the removed volume.

Triangles inside a region are removed, and those that its border cuts are subdivided there. The border of the region
within bone becomes the new surface, so that the margin applies to it too. Everything uncertain is kept: kept triangles
may extend into a region by `PIECE_MM`, and nothing outside the regions is lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vfix_engine.anatomy.surface import compact
from vfix_engine.arrays import Array, BoolArray
from vfix_engine.errors import InputError
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shape_surface import border_triangles
from vfix_engine.geometry.shapes import Shape
from vfix_engine.proximity.fields.side import SurfaceSide
from vfix_engine.proximity.fit import InsideTest
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.proximity.quarters import quarters

PIECE_MM = 0.03  # longest edge of a piece that is kept although it may extend into a region
NUDGE_MM = 0.01  # distance beyond a border at which another region is tested for continuing there
CUT_EDGE_MM = 0.25  # of the new surface's triangles before they are subdivided at the border of bone
_STEP_MM, _MOST_STEPS = 0.2, 4_000_000  # of the grid on which the volume is measured


@dataclass(frozen=True, eq=False)
class OpenedBone:
    """Bone after removal. mesh: its surface with outward normals. removed_mm3: volume of the removed bone."""

    mesh: TriangleMesh
    removed_mm3: float


def opened_bone(
    mesh: TriangleMesh, regions: Sequence[Shape], volume: Volume | None = None, *, inside: InsideTest | None = None
) -> OpenedBone:
    """Remove the bone inside regions from a surface.

    Args:
        mesh: the surface, LPS mm, outward normals.
        regions: spheres, capsules and boxes, LPS mm; they may overlap.
        volume: the CT, which distinguishes bone from air where the surface is new; None: the mesh's normals do.
        inside: test whether points (n, 3) lie in bone, replaces the CT.

    Raises:
        InputError: a region is a half-space, or the regions leave no bone.
    """
    if not regions:
        return OpenedBone(mesh, 0.0)
    inside = inside or _inside_of(mesh, volume)
    whole, pieces = _outside(mesh, regions)
    cut = [_new_surface(regions, number, inside) for number in range(len(regions))]
    added = np.concatenate([pieces, *cut])
    if not len(whole) and not len(added):
        raise InputError("the regions to be removed hold all of the bone; make them smaller")
    vertices, faces = compact(mesh.vertices, mesh.faces[whole])
    corners = len(vertices) + np.arange(3 * len(added), dtype=np.int64).reshape(-1, 3)
    opened = TriangleMesh(np.concatenate([vertices, added.reshape(-1, 3)]), np.concatenate([faces, corners]))
    return OpenedBone(opened, removed_mm3(regions, inside))


def removed_mm3(regions: Sequence[Shape], inside: InsideTest) -> float:
    """Volume of the bone inside regions in mm³, measured on a grid of 0.2 mm, or coarser in large regions.

    inside: test whether points (n, 3) lie in bone.
    """
    total = 0.0
    for number, region in enumerate(regions):
        corners = border_triangles(region, 1.0).reshape(-1, 3)
        if not len(corners):  # the region is smaller than the resolution of floats
            continue
        low, high = corners.min(axis=0), corners.max(axis=0)
        step = max(_STEP_MM, float(np.prod(high - low) / _MOST_STEPS) ** (1.0 / 3.0))
        counts = np.maximum(np.ceil((high - low) / step).astype(int), 1)
        size = (high - low) / counts
        axes = [low[k] + size[k] * (np.arange(counts[k]) + 0.5) for k in range(3)]
        for x in np.array_split(axes[0], max(1, counts[0] * counts[1] * counts[2] // 500_000)):
            if not len(x):
                continue
            points = np.stack(np.meshgrid(x, axes[1], axes[2], indexing="ij"), axis=-1).reshape(-1, 3)
            points = points[_within(region, points)]
            for other in regions[:number]:  # the intersection of two regions counts once
                points = points[~_within(other, points)]
            total += float(np.count_nonzero(inside(points))) * float(np.prod(size)) if len(points) else 0.0
    return total


def without_regions(inside: InsideTest, regions: Sequence[Shape]) -> InsideTest:
    """Return a test whether points lie in the remaining bone."""

    def left(points: Array) -> BoolArray:
        found = inside(points)
        for region in regions:
            found = found & ~_within(region, points)
        return found

    return left


def _inside_of(mesh: TriangleMesh, volume: Volume | None) -> InsideTest:
    if volume is not None:
        return lambda points: volume.sample(points) >= BONE_HU
    side = SurfaceSide(ProximityTree(mesh))
    return lambda points: ~side.outside(points)


def _within(region: Shape, points: Array) -> BoolArray:
    within: BoolArray = signed_distance(region, points) <= 0.0
    return within


def _outside(mesh: TriangleMesh, regions: Sequence[Shape]) -> tuple[NDArray[np.intp], Array]:
    """Indices of the faces that no region meets, and pieces (n, 3, 3) of those that a border cuts."""
    gone, near = _meeting(mesh.triangles, regions)
    return np.flatnonzero(~near), _pieces_outside(mesh.triangles[near & ~gone], regions)


def _pieces_outside(triangles: Array, regions: Sequence[Shape]) -> Array:
    """Parts of triangles (n, 3, 3) outside all regions, and those that extend into one by less than a piece."""
    kept = [np.zeros((0, 3, 3))]
    parts = triangles
    while len(parts):
        gone, crossing = _meeting(parts, regions)
        small = _longest(parts) <= PIECE_MM
        kept.append(parts[~gone & (~crossing | small)])
        parts = quarters(parts[~gone & crossing & ~small])
    return np.concatenate(kept)


def _new_surface(regions: Sequence[Shape], number: int, inside: InsideTest) -> Array:
    """Border of a region within bone and outside the other regions: triangles (n, 3, 3), normals into the region."""
    others = [region for index, region in enumerate(regions) if index != number]
    kept = [np.zeros((0, 3, 3))]
    parts = border_triangles(regions[number], CUT_EDGE_MM)[:, ::-1]
    while len(parts):
        gone, crossing = _meeting_beyond(parts, others)
        parts, crossing = parts[~gone], crossing[~gone]
        probes = np.concatenate([parts, parts.mean(axis=1, keepdims=True)], axis=1)
        in_bone = inside(probes.reshape(-1, 3)).reshape(-1, 4) if len(parts) else np.zeros((0, 4), dtype=bool)
        whole, none = in_bone.all(axis=1) & ~crossing, ~in_bone.any(axis=1)
        small = _longest(parts) <= PIECE_MM - NUDGE_MM
        kept.append(parts[whole | (small & ~none)])
        parts = quarters(parts[~whole & ~none & ~small])
    return np.concatenate(kept)


def _meeting(triangles: Array, regions: Sequence[Shape]) -> tuple[BoolArray, BoolArray]:
    """Masks of the triangles (n, 3, 3) that lie in one of the regions, and of those that may meet one."""
    middle = triangles.mean(axis=1)
    reach = np.linalg.norm(triangles - middle[:, None], axis=2).max(axis=1, initial=0.0)
    gone, meeting = np.zeros(len(triangles), dtype=bool), np.zeros(len(triangles), dtype=bool)
    for region in regions:
        # A region is convex: it contains a triangle whose corners it contains.
        gone |= _within(region, triangles.reshape(-1, 3)).reshape(-1, 3).all(axis=1)
        meeting |= signed_distance(region, middle) < reach
    return gone, meeting


def _meeting_beyond(parts: Array, regions: Sequence[Shape]) -> tuple[BoolArray, BoolArray]:
    """As `_meeting`, just beyond parts (n, 3, 3) of a region's border, whose normals point into it.

    A common part of the borders of two regions lies in both. It is the border of the remaining bone unless the other
    region continues beyond it. A part that follows the other's border is not subdivided.
    """
    normals = np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0])
    beyond = parts - NUDGE_MM * (normals / np.linalg.norm(normals, axis=1, keepdims=True))[:, None]
    gone, meeting = _meeting(beyond, regions)
    if not meeting.any():
        return gone, meeting
    middle = beyond.mean(axis=1, keepdims=True)
    probes = np.concatenate([beyond, (beyond + np.roll(beyond, -1, axis=1)) / 2.0, middle], axis=1)
    reach = np.linalg.norm(beyond - middle, axis=2).max(axis=1, initial=0.0)
    crossing = np.zeros(len(parts), dtype=bool)
    for region in regions:
        distance = signed_distance(region, probes.reshape(-1, 3)).reshape(-1, 7)
        follows = ((distance >= 0.0) & (distance <= 2.0 * NUDGE_MM)).all(axis=1)
        crossing |= (distance[:, 6] < reach) & ~follows
    return gone, crossing


def _longest(triangles: Array) -> Array:
    """(n,) longest edge of triangles (n, 3, 3)."""
    longest: Array = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2).max(axis=1, initial=0.0)
    return longest
