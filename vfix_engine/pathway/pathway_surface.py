"""Triangulated wall of a pathway, to which a snake's links are confined, for display together with the lumen's."""

from __future__ import annotations

import numpy as np

from ..geometry.mesh import TriangleMesh
from .checks import rim_points
from .pathway import Pathway


def pathway_surface(pathway: Pathway, t: float = 0.0) -> TriangleMesh:
    """Wall between a pathway's contours at the time t in s, closed at both ends, normals outwards; LPS mm."""
    found = pathway.contours(t)
    rim, cosine, sine = rim_points(found.radius)
    second = np.cross(found.tangent, found.first)
    ray = cosine[:, None] * found.first[:, None] + sine[:, None] * second[:, None]
    points = found.centre[:, None] + rim[..., None] * ray
    count, around = rim.shape
    here = np.arange(around)
    ahead = np.roll(here, -1)
    start = around * np.arange(count - 1)[:, None]
    a, b, c, d = (start + here, start + ahead, start + around + here, start + around + ahead)
    first, last = count * around, around * (count - 1)
    faces = [
        np.stack([a, b, d], axis=-1).reshape(-1, 3),
        np.stack([a, d, c], axis=-1).reshape(-1, 3),
        np.column_stack([np.full(around, first), ahead, here]),
        np.column_stack([np.full(around, first + 1), last + here, last + ahead]),
    ]
    vertices = np.concatenate([points.reshape(-1, 3), found.centre[[0, -1]]])
    return TriangleMesh(vertices, np.concatenate(faces))
