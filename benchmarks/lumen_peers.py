"""The query of Kwok 2013, eq. 1-9 as printed, in two versions: as loops for numba, and by numpy on whole arrays.

Both are complete and share no code with the engine: cross products, the projection of eq. 4 and its signed areas are
those of the paper, with the signs missing in print restored. Both decide eq. 5 as the engine does: a point counts as
inside up to 1e-10 mm beyond the line of an edge, since with 0 a point between two segments is outside of both by
rounding. Contours are circles.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import numba
import numpy as np

from vfix_engine.arrays import Array, IntArray

EDGE = 1e-10  # [mm] a point up to this far beyond the line of an edge is inside
AXIS = 1e-9  # [mm] nearer to the axis, eq. 1 defines no plane
AT_ONCE = 512  # vertices per array operation


@numba.njit(error_model="numpy", cache=True)
def section_as_printed(x: float, y: float, z: float, rows: Array, radius: Array, j: int) -> float:
    """Return δ_j in mm of one point from segment ``j``: eq. 1-7."""
    a0, a1, a2 = rows[j, 0] - x, rows[j, 1] - y, rows[j, 2] - z  # P_j − x
    b0, b1, b2 = rows[j, 3] - x, rows[j, 4] - y, rows[j, 5] - z  # P_{j+1} − x
    n0, n1, n2 = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0  # eq. 1
    length = rows[j, 22]
    nn = n0 * n0 + n1 * n1 + n2 * n2
    if nn <= (AXIS * length) * (AXIS * length):  # on the axis: the plane through the contour's first direction
        n0 = rows[j, 20] * rows[j, 25] - rows[j, 21] * rows[j, 24]
        n1 = rows[j, 21] * rows[j, 23] - rows[j, 19] * rows[j, 25]
        n2 = rows[j, 19] * rows[j, 24] - rows[j, 20] * rows[j, 23]
        nn = n0 * n0 + n1 * n1 + n2 * n2
    norm = sqrt(nn)
    r0, r1, r2 = n1 * rows[j, 8] - n2 * rows[j, 7], n2 * rows[j, 6] - n0 * rows[j, 8], n0 * rows[j, 7] - n1 * rows[j, 6]
    s = radius[j] / sqrt(r0 * r0 + r1 * r1 + r2 * r2)  # eq. 2
    c0, c1, c2 = a0 + s * r0, a1 + s * r1, a2 + s * r2  # v2 − x, eq. 3
    r0, r1, r2 = (
        n1 * rows[j, 11] - n2 * rows[j, 10],
        n2 * rows[j, 9] - n0 * rows[j, 11],
        n0 * rows[j, 10] - n1 * rows[j, 9],
    )
    s = radius[j + 1] / sqrt(r0 * r0 + r1 * r1 + r2 * r2)
    d0, d1, d2 = b0 + s * r0, b1 + s * r1, b2 + s * r2  # v3 − x

    # Eq. 4: drops the coordinate in which the normal is largest.
    k0, k1, k2 = abs(n0), abs(n1), abs(n2)
    if k0 >= k1 and k0 >= k2:
        scale = k0 / norm
        one, two, three, four = c1 * a2 - a1 * c2, d1 * c2 - c1 * d2, b1 * d2 - d1 * b2, a1 * b2 - b1 * a2
    elif k1 >= k2:
        scale = k1 / norm
        one, two, three, four = c2 * a0 - a2 * c0, d2 * c0 - c2 * d0, b2 * d0 - d2 * b0, a2 * b0 - b2 * a0
    else:
        scale = k2 / norm
        one, two, three, four = c0 * a1 - a0 * c1, d0 * c1 - c0 * d1, b0 * d1 - d0 * b1, a0 * b1 - b0 * a1
    m0, m1, m2 = d0 - c0, d1 - c1, d2 - c2
    mm = m0 * m0 + m1 * m1 + m2 * m2
    slack = EDGE * scale
    slack1, slack2 = slack * radius[j], slack * sqrt(mm)
    slack3, slack4 = slack * radius[j + 1], slack * length
    if one >= -slack1 and two >= -slack2 and three >= -slack3 and four >= -slack4:  # eq. 5
        return 0.0
    if one <= slack1 and two <= slack2 and three <= slack3 and four <= slack4:
        return 0.0
    mu = 0.0
    if mm > 0.0:
        mu = -(c0 * m0 + c1 * m1 + c2 * m2) / mm  # eq. 6
    if mu < 0.0:
        mu = 0.0
    if mu > 1.0:
        mu = 1.0
    g0, g1, g2 = c0 + mu * m0, c1 + mu * m1, c2 + mu * m2  # eq. 7
    return sqrt(g0 * g0 + g1 * g1 + g2 * g2)


@numba.njit(error_model="numpy", cache=True)
def literal_query(
    points: Array, start: IntArray, frames: Array, rows: Array, radius: Array, first: int, last: int, gap: Array
) -> Array:
    """Return d_l of eq. 9 (L,) of one pose by three plain loops; δ_i of eq. 8 is written to ``gap`` (V,)."""
    depth = np.zeros(len(start) - 1)
    for link in range(len(start) - 1):
        f = frames[link]
        for i in range(start[link], start[link + 1]):
            a, b, c = points[i, 0], points[i, 1], points[i, 2]
            x = f[0, 0] * a + f[0, 1] * b + f[0, 2] * c + f[0, 3]
            y = f[1, 0] * a + f[1, 1] * b + f[1, 2] * c + f[1, 3]
            z = f[2, 0] * a + f[2, 1] * b + f[2, 2] * c + f[2, 3]
            least = np.inf
            for j in range(first, last):
                least = min(least, section_as_printed(x, y, z, rows, radius, j))  # eq. 8
            gap[i] = least
            depth[link] = max(depth[link], least)  # eq. 9
    return depth


class NumpyQuery:
    """Eq. 1-9 with numpy: one array operation for many vertices and all segments at once.

    It takes 512 vertices at a time, so that intermediate results stay in the caches, which is twice as fast as all at
    once.
    """

    def __init__(self, points: Array, start: IntArray, rows: Array, radius: Array):
        """Prepare the query.

        points (V, 3): vertices in the frames of their links. start (L + 1,): first vertex of each link. rows: rows of
        the segments. radius: radii of the contours.
        """
        self._points, self._start, self._radius = points, start, radius
        self._link = np.repeat(np.arange(len(start) - 1), np.diff(start))
        self._rows = rows

    def deviations(self, frames: Array) -> tuple[Array, Array]:
        """Return d_l (L,) and δ_i (V,) in mm of one pose (L, 3, 4)."""
        turned = np.einsum("vij,vj->vi", frames[self._link, :, :3], self._points)
        places = np.ascontiguousarray((turned + frames[self._link, :, 3]).T)[:, :, None]  # (3, V, 1)
        rows, gap = self._rows.T[:, None, :], np.empty(len(self._points))
        for i in range(0, len(gap), AT_ONCE):
            gap[i : i + AT_ONCE] = _sections(places[:, i : i + AT_ONCE], rows, self._radius).min(axis=1)  # eq. 8
        return np.maximum.reduceat(gap, self._start[:-1]), gap  # eq. 9


def _sections(x: Array, row: Array, radius: Array) -> Array:
    """Return δ_j (V, S) in mm of all points (3, V, 1) from all segments (ROW, 1, S): eq. 1-7."""
    a, b = row[0:3] - x, row[3:6] - x
    normal = _cross(a, b)  # eq. 1
    squared = _dot(normal, normal)
    on_axis = squared <= (AXIS * row[22]) ** 2
    if on_axis.any():
        normal = np.where(on_axis, np.broadcast_to(_cross(row[19:22], row[23:26]), normal.shape), normal)
        squared = _dot(normal, normal)
    rho, sigma = _cross(normal, row[6:9]), _cross(normal, row[9:12])  # eq. 2
    c = a + (radius[:-1] / np.sqrt(_dot(rho, rho))) * rho  # eq. 3
    d = b + (radius[1:] / np.sqrt(_dot(sigma, sigma))) * sigma
    along = d - c
    length2 = _dot(along, along)
    size = np.abs(normal)
    slack = EDGE * size.max(axis=0) / np.sqrt(squared)
    drop = size.argmax(axis=0)[None]  # eq. 4
    u, v = (drop + 1) % 3, (drop + 2) % 3
    corners = [(np.take_along_axis(p, u, axis=0)[0], np.take_along_axis(p, v, axis=0)[0]) for p in (a, c, d, b)]
    slacks = slack * radius[:-1], slack * np.sqrt(length2), slack * radius[1:], slack * row[22]
    above, below = np.ones(slack.shape, dtype=bool), np.ones(slack.shape, dtype=bool)
    for i in range(4):
        (pu, pv), (qu, qv) = corners[i], corners[(i + 1) % 4]
        area = qu * pv - pu * qv
        above &= area >= -slacks[i]
        below &= area <= slacks[i]
    mu = np.clip(-_dot(c, along) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)  # eq. 6
    gap = c + mu * along  # eq. 7
    return np.where(above | below, 0.0, np.sqrt(_dot(gap, gap)))  # eq. 5


def _cross(a: Array, b: Array) -> Array:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _dot(a: Array, b: Array) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
