"""Distances between segments and triangles by numpy alone, over all triangles, independent of the engine's kernels.

A triangle is skipped only if the ball around its centroid is certainly too far away.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vfix_engine.arrays import Array


class BruteForce:
    """All triangles (F, 3, 3) of a mesh, in mm."""

    def __init__(self, triangles: Array):
        self._triangles = triangles
        self._centre = triangles.mean(axis=1)
        self._radius: Array = np.linalg.norm(triangles - self._centre[:, None], axis=2).max(axis=1)

    def near(self, start: Array, end: Array, reach: float) -> tuple[NDArray[np.int64], Array]:
        """Triangles (n,) within ``reach`` mm of the axis from start to end, and their distances (n,)."""
        picked = np.flatnonzero(_point_segment(self._centre, start, end) - self._radius <= reach + 1e-6)
        distance = segment_triangles(start, end, self._triangles[picked])
        keep = distance <= reach
        return picked[keep], distance[keep]

    def least(self, start: Array, end: Array) -> float:
        """Distance of the axis to the nearest triangle."""
        away = _point_segment(self._centre, start, end)  # the centroid lies on the triangle
        picked = np.flatnonzero(away - self._radius <= away.min() + 1e-6)
        return float(segment_triangles(start, end, self._triangles[picked]).min())


def segment_triangles(p: Array, q: Array, triangles: Array) -> Array:
    """Distances (n,) of the segment from p to q, (3,) each, to triangles (n, 3, 3) with area."""
    if not len(triangles):
        return np.empty(0)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    best = np.min([_segment_segment(p, q, a, b), _segment_segment(p, q, b, c), _segment_segment(p, q, c, a)], axis=0)
    normal = np.cross(b - a, c - a)
    square = np.einsum("ij,ij->i", normal, normal)
    for point in (p, q):
        height = np.einsum("ij,ij->i", point - a, normal) / square
        foot = point - height[:, None] * normal
        gap = np.abs(height) * np.sqrt(square)
        best = np.where(_inside(foot, a, b, c, normal), np.minimum(best, gap), best)
    climb = normal @ (q - p)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.einsum("ij,ij->i", a - p, normal) / climb
    meets = (t >= 0.0) & (t <= 1.0)
    cross = p + np.where(meets, t, 0.0)[:, None] * (q - p)
    return np.where(meets & _inside(cross, a, b, c, normal), 0.0, best)


def _inside(points: Array, a: Array, b: Array, c: Array, normal: Array) -> NDArray[np.bool_]:
    """Return whether points (n, 3) in the planes of triangles lie in the triangles."""
    sides = [np.einsum("ij,ij->i", np.cross(w - v, points - v), normal) for v, w in ((a, b), (b, c), (c, a))]
    return np.asarray(np.all(np.array(sides) >= 0.0, axis=0))


def _point_segment(points: Array, p: Array, q: Array) -> Array:
    d, to = q - p, points - p
    size = float(d @ d)
    t = np.clip(to @ d / size, 0.0, 1.0) if size > 0.0 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(to - t[:, None] * d, axis=1))


def _segment_segment(p: Array, q: Array, a: Array, b: Array) -> Array:
    """Return distances (n,) of a segment p q to segments a b (n, 3), at the crossing of the lines or at an end."""
    d, e, r = q - p, b - a, p - a
    dd, ee = float(d @ d), np.einsum("ij,ij->i", e, e)
    de, dr, er = e @ d, r @ d, np.einsum("ij,ij->i", e, r)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (de * er - ee * dr) / (dd * ee - de * de)
        s = (dd * er - de * dr) / (dd * ee - de * de)
    both = (t >= 0.0) & (t <= 1.0) & (s >= 0.0) & (s <= 1.0)
    gap = r + np.where(both, t, 0.0)[:, None] * d - np.where(both, s, 0.0)[:, None] * e
    lines = np.where(both, np.linalg.norm(gap, axis=1), np.inf)
    ends = [_points_segments(np.broadcast_to(x, a.shape), a, b) for x in (p, q)]
    return np.asarray(np.min([lines, *ends, _point_segment(a, p, q), _point_segment(b, p, q)], axis=0))


def _points_segments(points: Array, a: Array, b: Array) -> Array:
    e = b - a
    size = np.einsum("ij,ij->i", e, e)
    s = np.clip(np.einsum("ij,ij->i", points - a, e) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - a - s[:, None] * e, axis=1))
