"""Surface vertices of a snake's links.

Kwok 2013, section IV.B: "The boundary of each link can be described as a union of a sphere and a cylinder"; step 7 of
section III.A.2 measures at such vertices. The cylinder ends at the link's frame with the sphere's centre; its rear end
lies inside the sphere of the link before it.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..arrays import Array, IntArray
from ..errors import RobotError
from ..geometry.mesh import TriangleMesh

_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))  # [rad] between points of a Fibonacci spiral
MOST_VERTICES = 10_000_000  # 240 MB of coordinates
_FEWEST = 8  # vertices of a link that have a convex hull
DENSE = 40  # places of a mesh for each vertex that is selected


class LinkVertices(NamedTuple):
    """Vertices of a snake's surface.

    points: (V, 3) mm, each in the frame of its own link, in the order of the links; start: (L + 1,) int64, link l owns
    points[start[l] : start[l + 1]]. Both are read-only and contiguous.
    """

    points: Array
    start: IntArray


@lru_cache(maxsize=16)
def link_vertices(links: int, count: int, length_mm: float, radius_mm: float, sphere_radius_mm: float) -> LinkVertices:
    """Return exactly ``count`` vertices, distributed evenly over all links; the remainder goes to the last links.

    The tip's pole (0, 0, sphere_radius_mm) is a vertex of every link.

    Raises:
        RobotError: not an integer, fewer vertices than links, or more than ten million.
    """
    _check_count(links, count)
    each = count // links
    few = _one_link(each, length_mm, radius_mm, sphere_radius_mm)
    return _of_links(few, _one_link(each + 1, length_mm, radius_mm, sphere_radius_mm), links, count)


@lru_cache(maxsize=16)
def between_vertices_mm(each: int, length_mm: float, radius_mm: float, sphere_radius_mm: float) -> float:
    """By how much a snake with ``each`` vertices a link can be deeper between them than at them, in a convex lumen.

    The depth is then a convex function, so it is largest where a sphere or a cylinder touches a plane from inside, and
    a vertex is less deep by at most the difference of their extents in the direction of that plane's normal. Of the
    rear ends, which lie in the link before, it does not speak.

    Returns:
        mm: the largest such difference over all directions. The extent of the vertices is least at normals of their
        convex hull, or at the border of those directions, of which 7,200 are tried.
    """
    from scipy.spatial import ConvexHull  # imported here: slow to load

    if each < _FEWEST:
        return sphere_radius_mm  # the pole alone is less deep by no more
    points = _one_link(each, length_mm, radius_mm, sphere_radius_mm)
    lowest = -math.sqrt(max(sphere_radius_mm**2 - radius_mm**2, 0.0)) / sphere_radius_mm  # z of a normal at the waist
    facets = ConvexHull(points).equations
    turn = np.linspace(0.0, 2.0 * math.pi, 7200, endpoint=False)
    across = math.sqrt(1.0 - lowest * lowest)
    border = np.column_stack([across * np.cos(turn), across * np.sin(turn), np.full(len(turn), lowest)])
    extents = np.append(-facets[facets[:, 2] >= lowest, 3], (points @ border.T).max(axis=0).min())
    return float(sphere_radius_mm - extents.min())


def mesh_vertices(mesh: TriangleMesh, links: int, count: int) -> LinkVertices:
    """Return exactly ``count`` vertices on links of any shape, distributed as by ``link_vertices``.

    Kwok 2013, section III.B.2: "The positions of the surface vertices evenly covering robot link l can be automatically
    selected from the CAD model". Each is the place of the surface farthest from those selected before, so that n of
    them are the first n of any larger number; the first is the foremost.

    Args:
        mesh: surface of one link, mm, in the link's frame: z along the link, the origin at its far end.

    Raises:
        RobotError: as ``link_vertices``; a mesh without area.
    """
    _check_count(links, count)
    each, more = divmod(count, links)
    chosen = _farthest(_dense(mesh, DENSE * (each + 1)), each + (1 if more else 0))
    return _of_links(chosen[:each], chosen, links, count)


def _check_count(links: int, count: int) -> None:
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or not links <= count <= MOST_VERTICES:
        raise RobotError(
            f"{count!r:.20} vertices for {links:,} links; a whole number, at least one a link, "
            f"at most {MOST_VERTICES:,} in all"
        )


def _of_links(few: Array, many: Array, links: int, count: int) -> LinkVertices:
    """``few`` or, for the last links, ``many`` points (n, 3) and (n + 1, 3) of each."""
    more = count % links
    of_link = np.full(links, len(few), dtype=np.int64)
    of_link[links - more :] += 1
    start = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(of_link)])
    points = np.concatenate([few] * (links - more) + [many] * more)
    for array in (points, start):
        array.setflags(write=False)
    return LinkVertices(points, start)


def _dense(mesh: TriangleMesh, least: int) -> Array:
    """Points (n, 3) of a surface, n at least ``least``: the centres of equal parts of every triangle, by its area."""
    corners = mesh.triangles
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if not areas.sum() > 0.0:
        raise RobotError("the mesh of a link has no area, so no vertices can be selected on it")
    cuts = np.maximum(1, np.ceil(np.sqrt(least * areas / areas.sum()))).astype(int)  # of each side
    parts = []
    for cut in np.unique(cuts):
        i, j = np.divmod(np.arange(cut * cut), cut)
        upper = i + j >= cut  # the rhombus beyond the diagonal is folded back: the triangles that stand on their heads
        u, v = (
            np.where(upper, cut - 1 - i + 2 / 3, i + 1 / 3) / cut,
            np.where(upper, cut - 1 - j + 2 / 3, j + 1 / 3) / cut,
        )
        a, b, c = (corners[cuts == cut, k, None] for k in range(3))
        parts.append((a + u[:, None] * (b - a) + v[:, None] * (c - a)).reshape(-1, 3))
    return np.concatenate(parts)


def _farthest(points: Array, count: int) -> Array:
    """``count`` of the points (n, 3), each the farthest from those before; ties by their order."""
    at = int(np.argmax(points[:, 2]))
    chosen, near = [at], np.full(len(points), np.inf)
    for _ in range(count - 1):
        near = np.minimum(near, np.einsum("ij,ij->i", points - points[at], points - points[at]))
        at = int(np.argmax(near))
        chosen.append(at)
    return np.ascontiguousarray(points[chosen])


def _one_link(count: int, length: float, radius: float, sphere: float) -> Array:
    """Points (count, 3) on the part of the cylinder z ∈ [−length, 0] and of the sphere that is outside the other.

    They form a spiral from the rear to the pole with equal surface areas between neighbours, which on a sphere are
    equal steps along z (Archimedes), as on a cylinder.
    """
    waist = -math.sqrt(max(sphere * sphere - radius * radius, 0.0))  # z of the intersection of sphere and cylinder
    cylinder = radius * (length + waist)  # areas over 2π
    ball = sphere * (sphere - waist)
    number = np.arange(count)
    area = (number + 0.5) / count * (cylinder + ball)
    z = np.where(area < cylinder, area / radius - length, (area - cylinder) / sphere + waist)
    z[-1] = sphere
    across = np.where(area < cylinder, radius, np.sqrt(np.maximum(sphere * sphere - z * z, 0.0)))
    across[-1] = 0.0
    turn = _GOLDEN_ANGLE * number
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
