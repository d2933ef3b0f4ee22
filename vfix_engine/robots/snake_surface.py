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

_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))  # [rad] between points of a Fibonacci spiral
MOST_VERTICES = 10_000_000  # 240 MB of coordinates


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
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or not links <= count <= MOST_VERTICES:
        raise RobotError(
            f"{count!r:.20} vertices for {links:,} links; a whole number, at least one a link, "
            f"at most {MOST_VERTICES:,} in all"
        )
    each, more = divmod(count, links)
    of_link = np.full(links, each, dtype=np.int64)
    of_link[links - more :] += 1
    start = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(of_link)])
    few = _one_link(each, length_mm, radius_mm, sphere_radius_mm)
    many = _one_link(each + 1, length_mm, radius_mm, sphere_radius_mm)
    points = np.concatenate([few] * (links - more) + [many] * more)
    for array in (points, start):
        array.setflags(write=False)
    return LinkVertices(points, start)


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
