"""Signed clearance of vertices with its gradient, and the selection of those that a QP needs, compiled."""

from __future__ import annotations

from math import sqrt

import numpy as np

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled, no_refcount
from .query_tree import span
from .section import section_distance

_ON_WALL = 1e-8  # [mm] closer to the wall the gradient is evaluated _OUT further outside
_OUT = 1e-6  # [mm]
_TURN = 1e-5  # [rad] rotation of the section in the finite difference around the axis


@compiled
def vertex_clearances(
    rows: Array,
    polar: Array,
    window: IntArray,
    frames: Array,
    points: Array,
    start: IntArray,
    signed: Array,
    gradient: Array,
    segment: IntArray,
) -> None:
    """Kernel of ``clearance.clearances``: signed (V,), gradient (V, 3), segment (V,) of points (V, 3) of the links."""
    near = (window[0, 0] + window[0, 1]) // 2
    for link in range(len(start) - 1):
        for i in range(start[link], start[link + 1]):
            a, b, c = points[i, 0], points[i, 1], points[i, 2]
            x = frames[link, 0, 0] * a + frames[link, 0, 1] * b + frames[link, 0, 2] * c + frames[link, 0, 3]
            y = frames[link, 1, 0] * a + frames[link, 1, 1] * b + frames[link, 1, 2] * c + frames[link, 1, 3]
            z = frames[link, 2, 0] * a + frames[link, 2, 1] * b + frames[link, 2, 2] * c + frames[link, 2, 3]
            signed[i], segment[i], near = point_clearance(rows, polar, x, y, z, near, window[link, 0], window[link, 1])
            put_gradient(rows, polar, x, y, z, segment[i], signed[i] > 0.0, gradient, i)


@no_refcount
def point_clearance(
    rows: Array, polar: Array, x: float, y: float, z: float, near: int, first: int, last: int
) -> tuple[float, int, int]:
    """Return the signed clearance, the segment that determines it, and the segment that the point lies in or before."""
    here, low, high = span(rows, x, y, z, 0.0, near, first, last)
    outside, at_outside, wall, at_wall = np.inf, here, np.inf, here
    for i in range(first - (high + 1 - low), last):
        # Segments at the point come first, because they exclude most others.
        j = low + i - first + (high + 1 - low) if i < first else i
        if i >= low and i <= high:
            continue
        if i >= first:
            u, v, w = rows[j, 14] - x, rows[j, 15] - y, rows[j, 16] - z
            reach = rows[j, 17] + (outside if outside > 0.0 else wall)
            if u * u + v * v + w * w >= reach * reach:
                continue
        gap = section_distance(x, y, z, rows, polar, j)[0]
        if gap < outside:
            outside, at_outside = max(gap, 0.0), j
        if abs(gap) < wall:
            wall, at_wall = abs(gap), j
    if outside > 0.0:
        return outside, at_outside, here
    return -wall, at_wall, here


@no_refcount
def put_gradient(
    rows: Array, polar: Array, x: float, y: float, z: float, j: int, outside: bool, gradient: Array, i: int
) -> None:
    """Write the gradient of the signed clearance from segment ``j`` to row ``i``."""
    ex, ey, ez = rows[j, 19], rows[j, 20], rows[j, 21]
    px, py, pz = x - rows[j, 0], y - rows[j, 1], z - rows[j, 2]
    t = px * ex + py * ey + pz * ez
    wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
    h = sqrt(wx * wx + wy * wy + wz * wz)
    sign = 1.0 if outside else -1.0
    gap, cx, cy, cz = section_distance(x, y, z, rows, polar, j)
    if abs(gap) < _ON_WALL and h > 0.0:
        x, y, z = x + _OUT * wx / h, y + _OUT * wy / h, z + _OUT * wz / h
        gap, cx, cy, cz = section_distance(x, y, z, rows, polar, j)
        sign = 1.0
    size = sign / abs(gap) if gap != 0.0 else 0.0
    gradient[i, 0], gradient[i, 1], gradient[i, 2] = size * (x - cx), size * (y - cy), size * (z - cz)
    if h <= _OUT:
        return
    # Central difference around the axis: the section rotated slightly to both sides.
    ax, ay, az = (ey * wz - ez * wy) * _TURN, (ez * wx - ex * wz) * _TURN, (ex * wy - ey * wx) * _TURN
    after = abs(section_distance(x + ax, y + ay, z + az, rows, polar, j)[0])
    before = abs(section_distance(x - ax, y - ay, z - az, rows, polar, j)[0])
    # Both points are further from the axis than the given one by h _TURN² / 2, which cancels.
    share = sign * (after - before) / (2.0 * _TURN * _TURN * h * h)
    gradient[i, 0] += share * ax
    gradient[i, 1] += share * ay
    gradient[i, 2] += share * az


@compiled
def choose_binding(
    points: Array,
    start: IntArray,
    signed: Array,
    gradient: Array,
    least: Array,
    per_link: int,
    apart: float,
    alike: float,
    chosen: IntArray,
) -> int:
    """Write to ``chosen`` the vertices with the largest ``signed`` above ``least`` (L,), thinned; return the number."""
    count = 0
    left = np.ones(len(points), dtype=np.bool_)
    for link in range(len(start) - 1):
        for _ in range(per_link):
            best = -1
            for i in range(start[link], start[link + 1]):
                if left[i] and signed[i] >= least[link] and (best < 0 or signed[i] > signed[best]):
                    best = i
            if best < 0:
                break
            chosen[count] = best
            count += 1
            for i in range(start[link], start[link + 1]):
                a, b, c = points[i, 0] - points[best, 0], points[i, 1] - points[best, 1], points[i, 2] - points[best, 2]
                cosine, one, two = 0.0, 0.0, 0.0
                for k in range(3):
                    cosine += gradient[i, k] * gradient[best, k]
                    one += gradient[i, k] * gradient[i, k]
                    two += gradient[best, k] * gradient[best, k]
                near = a * a + b * b + c * c < apart * apart
                if i == best or (near and cosine > alike * sqrt(one * two)):
                    left[i] = False
    return count
