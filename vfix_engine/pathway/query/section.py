"""Distance of a point to one segment of a constraint pathway: Kwok 2013, eq. 1-7, as one function of plain Python.

It is written once: Python runs it directly, numba compiles it for the CPU and numba-cuda for a GPU. So its arguments
are numbers and two arrays, it calls only roots and ``atan2``, and every comparison is False for NaN.

The printed equations intersect the segment with the plane through the point and the axis P_j P_{j+1}. Here the
section's own coordinates are used: t along the axis from P_j, h the distance from the axis line. Neither the normal of
eq. 1 nor the projection of eq. 4 is then needed: the signed areas of eq. 4 are computed in the plane itself.
"""

from __future__ import annotations

from math import atan2, sqrt

from ...arrays import Array
from ...kernels.compiled import no_refcount

EDGE = 1e-10  # [mm] tolerance beyond an edge within which a point counts as inside: eq. 5 with 0 leaves gaps
AXIS = 1e-9  # [mm] closer to the axis line than this, eq. 1 defines no plane
_TURN = 6.283185307179586  # 2π


def signed_distance(
    x: float, y: float, z: float, rows: Array, polar: Array, j: int
) -> tuple[float, float, float, float]:
    """Signed distance in mm of a point to segment ``j`` and the nearest point of the section's wall v2 v3.

    Above 0 it is δ_j of eq. 7. At or below 0 the point is inside by eq. 5 and it is minus the distance to v2 v3.
    ``rows`` (S, ROW) and ``polar`` (S + 1, A) are those of ``packed.PackedPathway``; A = 1 means circular contours.
    A point with a NaN has the distance NaN. It is one function without calls, so that numba-cuda can compile it
    unchanged.
    """
    px, py, pz = x - rows[j, 0], y - rows[j, 1], z - rows[j, 2]
    ex, ey, ez = rows[j, 19], rows[j, 20], rows[j, 21]
    length = rows[j, 22]
    t = px * ex + py * ey + pz * ez
    wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
    h = sqrt(wx * wx + wy * wy + wz * wz)
    s = h
    if h <= AXIS:  # eq. 1: the point is on the axis; use the plane through the contour's first direction
        wx, wy, wz = rows[j, 23], rows[j, 24], rows[j, 25]
        s = wx * ex + wy * ey + wz * ez
        wx, wy, wz = wx - s * ex, wy - s * ey, wz - s * ez
        s = sqrt(wx * wx + wy * wy + wz * wz)
    wx, wy, wz = wx / s, wy / s, wz / s

    a = rows[j, 6] * ex + rows[j, 7] * ey + rows[j, 8] * ez  # eq. 2: n × M in the directions of e and w is (-b, a)
    b = rows[j, 6] * wx + rows[j, 7] * wy + rows[j, 8] * wz
    s = sqrt(a * a + b * b)
    t2, h2 = -b / s, a / s
    a = rows[j, 9] * ex + rows[j, 10] * ey + rows[j, 11] * ez
    b = rows[j, 9] * wx + rows[j, 10] * wy + rows[j, 11] * wz
    s = sqrt(a * a + b * b)
    t3, h3 = -b / s, a / s

    radius2, radius3 = polar[j, 0], polar[j + 1, 0]
    count = polar.shape[1]
    if count > 1:
        for side in range(2):  # R_j(ρ̂) between the two given directions of the contour next to ρ̂
            at, up, out = (23, t2, h2) if side == 0 else (29, t3, h3)
            gx, gy, gz = up * ex + out * wx, up * ey + out * wy, up * ez + out * wz
            cosine = gx * rows[j, at] + gy * rows[j, at + 1] + gz * rows[j, at + 2]
            sine = gx * rows[j, at + 3] + gy * rows[j, at + 4] + gz * rows[j, at + 5]
            share = atan2(sine, cosine) * (count / _TURN)
            if share < 0.0:
                share += count
            if not share < count:  # slightly below 0 plus a turn rounds to a full turn
                share = 0.0
            k = int(share)
            share -= k
            after = k + 1 if k + 1 < count else 0
            radius = polar[j + side, k] * (1.0 - share) + polar[j + side, after] * share
            if side == 0:
                radius2 = radius
            else:
                radius3 = radius

    u2, v2 = radius2 * t2, radius2 * h2  # eq. 3
    u3, v3 = length + radius3 * t3, radius3 * h3
    du, dv = u3 - u2, v3 - v2
    dd = du * du + dv * dv
    # Eq. 4-5: distance beyond the edges v1 v2, v3 v4 and v2 v3; v4 v1 is the axis, and h is never below it.
    inside = (
        t * h2 - h * t2 >= -EDGE
        and (length - t) * h3 + h * t3 >= -EDGE
        and du * (v2 - h) - dv * (u2 - t) >= -EDGE * sqrt(dd)
    )
    mu = 0.0
    if dd > 0.0:
        mu = ((t - u2) * du + (h - v2) * dv) / dd  # eq. 6
    if mu < 0.0:
        mu = 0.0
    if mu > 1.0:
        mu = 1.0
    u, v = u2 + mu * du, v2 + mu * dv
    gap = sqrt((t - u) * (t - u) + (h - v) * (h - v))  # eq. 7
    if inside:
        gap = -gap
    return gap, rows[j, 0] + u * ex + v * wx, rows[j, 1] + u * ey + v * wy, rows[j, 2] + u * ez + v * wz


section_distance = no_refcount(signed_distance)
"""``signed_distance`` for kernels of the processor."""
