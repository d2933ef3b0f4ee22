"""Pieces of the compiled query for contours with polar radii, 16 points at once.

The polar angle of a point's direction in either contour comes first, in lanes; then the radii there are looked up one
by one; and the rest is in lanes again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, vectorised
from .query_blocks import RADIUS, THICKNESS
from .query_lanes import RADII, TURNED, WIDTH, WORK
from .section import AXIS

Array = NDArray[np.float64]

_TURN = 6.283185307179586
_EIGHTH = 0.4142135623730951  # tan π/8
# atan z = z · p(z²) for z² ≤ tan² π/8, interpolated in Chebyshev's places; off by no more than 6e-17.
_P0, _P1, _P2, _P3 = -0.3333333333333312, 0.19999999999940535, -0.14285714279231376, 0.11111110744489916
_P4, _P5, _P6, _P7 = -0.09090896805970061, 0.07692045380163111, -0.06662953121072139, 0.058468911831827994
_P8, _P9, _P10 = -0.0503516960175827, 0.03796709126162387, -0.01780747025122684


@vectorised
def put_angles(rows: Array, j: int, side: int, count: float, work: Array) -> None:
    """Polar angles of the 16 places' directions in contour ``j`` + ``side``, 0 to ``count`` for a turn, into RADII."""
    side &= 1
    ax, ay, az, ex, ey, ez = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 19], rows[j, 20], rows[j, 21]
    mx, my, mz = rows[j, 6 + 3 * side], rows[j, 7 + 3 * side], rows[j, 8 + 3 * side]
    fx, fy, fz = rows[j, 23 + 6 * side], rows[j, 24 + 6 * side], rows[j, 25 + 6 * side]
    gx, gy, gz = rows[j, 26 + 6 * side], rows[j, 27 + 6 * side], rows[j, 28 + 6 * side]
    facing, along_f, along_g = rows[j, 40 + side], ex * fx + ey * fy + ez * fz, ex * gx + ey * gy + ez * gz
    sx, sy, sz = rows[j, 23], rows[j, 24], rows[j, 25]  # eq. 1 for a place on the axis
    along = sx * ex + sy * ey + sz * ez
    sx, sy, sz = sx - along * ex, sy - along * ey, sz - along * ez
    for k in range(16):
        px, py, pz = work[k] - ax, work[16 + k] - ay, work[32 + k] - az
        t = px * ex + py * ey + pz * ez
        wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
        on_axis = wx * wx + wy * wy + wz * wz <= AXIS * AXIS
        wx, wy, wz = sx if on_axis else wx, sy if on_axis else wy, sz if on_axis else wz
        lean = mx * wx + my * wy + mz * wz
        # Eq. 2: ρ lies along -lean · e + facing · w.
        cosine = facing * (fx * wx + fy * wy + fz * wz) - lean * along_f
        sine = facing * (gx * wx + gy * wy + gz * wz) - lean * along_g
        a, b = abs(cosine), abs(sine)
        low, high = b if b < a else a, a if b < a else b
        beyond = low > _EIGHTH * high
        z = (low - high if beyond else low) / (low + high if beyond else high)
        y = z * z
        p = _P10 * y + _P9
        p = ((((p * y + _P8) * y + _P7) * y + _P6) * y + _P5) * y + _P4
        p = ((((p * y + _P3) * y + _P2) * y + _P1) * y + _P0) * y
        angle = z + z * p + (0.125 * _TURN if beyond else 0.0)
        angle = 0.25 * _TURN - angle if b > a else angle
        angle = 0.5 * _TURN - angle if cosine < 0.0 else angle
        angle = _TURN - angle if sine < 0.0 else angle
        work[RADII + 16 * side + k] = angle * (count / _TURN)


@borrowing
def look_up(polar: Array, contour: int, at: float) -> float:
    """The radius at an angle of 0 to A, linear between the given ones."""
    count = polar.shape[1]
    k = int(at) if 0.0 <= at < count else 0
    share = at - k if 0.0 <= at < count else 0.0
    after = k + 1 if k + 1 < count else 0
    radius: float = polar[contour, k] * (1.0 - share) + polar[contour, after] * share
    return radius


@borrowing
def put_radii(rows: Array, polar: Array, j: int, work: Array) -> None:
    """Radii of both contours of segment ``j`` in the sections of the 16 places."""
    for side in range(2):
        put_angles(rows, j, side, float(polar.shape[1]), work)
        for k in range(RADII + 16 * side, RADII + 16 * side + 16):
            work[k] = look_up(polar, j + side, work[k])


@vectorised
def put_widths(ball: Array, node: int, rows: Array, j: int, count: float, work: Array) -> None:
    """Half the polar angle, 0 to ``count`` for a turn, that each of 16 plates can take in either contour.

    Seen along the axis a plate takes asin(radius / h) ≤ u + (π/2 - 1) u³ to either side, u = radius / h. In a contour
    that leans by β an angle is at most 1 / cos β of that about the axis.
    """
    ax, ay, az, ex, ey, ez = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 19], rows[j, 20], rows[j, 21]
    scale = count / (_TURN * min(rows[j, 40], rows[j, 41])) * (1.0 + 1e-9)
    for k in range(16):
        px, py, pz = work[k] - ax, work[16 + k] - ay, work[32 + k] - az
        t = px * ex + py * ey + pz * ez
        wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
        ww = wx * wx + wy * wy + wz * wz
        radius = ball[node, RADIUS + k]
        u = radius / np.sqrt(ww)
        work[WIDTH + k] = scale * (u + 0.5708 * u * u * u) if radius * radius < ww else count


@borrowing
def put_least_radii(ball: Array, node: int, rows: Array, polar: Array, j: int, work: Array) -> None:
    """The least radii of both contours in all sections that the 16 plates reach into."""
    count = polar.shape[1]
    put_widths(ball, node, rows, j, float(count), work)
    for side in range(2):
        put_angles(rows, j, side, float(count), work)
        for lane in range(16):
            if ball[node, RADIUS + lane] < 0.0:  # no child
                break
            at, width = work[RADII + 16 * side + lane], work[WIDTH + lane]
            if not (2.0 * width < count and 0.0 <= at <= count):
                at, width = 0.0, 0.5 * count
            low, high = at - width, at + width
            low += count if low < 0.0 else 0.0
            high -= count if high >= count else 0.0
            least = min(look_up(polar, j + side, low), look_up(polar, j + side, high))
            k = int(low) + 1
            for _ in range(int(2.0 * width) + 1):
                k -= count if k >= count else 0
                least = min(least, polar[j + side, k])
                k += 1
            work[RADII + 16 * side + lane] = least


@vectorised
def raise_polar_bounds(ball: Array, node: int, rows: Array, j: int, work: Array, at: int) -> None:
    """``query_lanes.raise_bounds`` with a line below the wall (``inner_line.py``) for each plate's own radii."""
    ax, ay, az, bx, by, bz = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 3], rows[j, 4], rows[j, 5]
    mx, my, mz, nx, ny, nz = rows[j, 6], rows[j, 7], rows[j, 8], rows[j, 9], rows[j, 10], rows[j, 11]
    ex, ey, ez, length = rows[j, 19], rows[j, 20], rows[j, 21], rows[j, 22]
    cosine2, cosine3 = min(rows[j, 40], 1.0), min(rows[j, 41], 1.0)
    sine2, sine3 = np.sqrt(1.0 - cosine2 * cosine2), np.sqrt(1.0 - cosine3 * cosine3)
    tangent = max(sine2 / cosine2, sine3 / cosine3)
    steepest, cosine = 0.25 / max(tangent, 1e-3), min(cosine2, cosine3)
    per_mm = 1.0 / length
    at &= WORK - 1
    for k in range(16):
        x, y, z = work[k], work[16 + k], work[32 + k]
        radius, thickness = ball[node, RADIUS + k], ball[node, THICKNESS + k]
        radius2, radius3 = work[RADII + k], work[RADII + 16 + k]
        slope = (radius3 * cosine3 - radius2 * cosine2) * per_mm
        slope = slope if slope < steepest else steepest
        slope = slope if slope > -steepest else -steepest
        steep = abs(slope)
        height2, height3 = radius2 * (cosine2 - steep * sine2), radius3 * (cosine3 - steep * sine3) - slope * length
        height = height2 if height2 < height3 else height3
        px, py, pz = x - ax, y - ay, z - az
        t = px * ex + py * ey + pz * ez
        wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
        ww = wx * wx + wy * wy + wz * wz
        out = wx * work[TURNED + k] + wy * work[TURNED + 16 + k] + wz * work[TURNED + 32 + k]
        aside = ww - out * out
        support = abs(out) * thickness + np.sqrt(aside if aside > 0.0 else 0.0) * radius
        above = np.sqrt(ww + 2.0 * support + radius * radius) - (height + slope * t) + radius * steep
        before = px * mx + py * my + pz * mz + radius
        behind = (bx - x) * nx + (by - y) * ny + (bz - z) * nz + radius
        bound = above / (cosine * (1.0 - steep * tangent))
        bound = bound if min(above, min(before, behind)) > 0.0 else 0.0
        work[at + k] = max(work[at + k], bound)
