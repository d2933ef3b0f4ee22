"""Parts of the compiled query for contours with polar radii, 16 points at once.

The polar angles of a point's direction in both contours are computed in SIMD lanes; then the radii are looked up one
by one; and the rest is in lanes again (``query_simd.lower_gaps``).
"""

from __future__ import annotations

from ...arrays import Array
from ...kernels.compiled import inlined, no_refcount, vectorised
from .query_simd import RADII
from .section import AXIS

_MOST = 0xFFFFFFFF
_TURN = 6.283185307179586
_EIGHTH = 0.4142135623730951  # tan π/8
# atan z = z + z · y p(y), y = z² ≤ tan² π/8, interpolated at Chebyshev nodes; error at most 6e-17.
_P0, _P1, _P2, _P3 = -0.3333333333333312, 0.19999999999940535, -0.14285714279231376, 0.11111110744489916
_P4, _P5, _P6, _P7 = -0.09090896805970061, 0.07692045380163111, -0.06662953121072139, 0.058468911831827994
_P8, _P9, _P10 = -0.0503516960175827, 0.03796709126162387, -0.01780747025122684


@inlined
def angle_of(cosine: float, sine: float) -> float:
    """Angle of a direction, 0 to 2π; branch-free."""
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
    return _TURN - angle if sine < 0.0 else angle


@vectorised
def put_angles(rows: Array, j: int, count: float, work: Array) -> None:
    """Write polar angles of the 16 points' directions in both contours of segment ``j`` to RADII and the 16 behind.

    A full turn is ``count``. By eq. 2 ρ is parallel to -(M·w) e + (M·e) w; its components along a contour's directions
    are linear in w, and equal to those of the whole vector from P_j, since they are perpendicular to e:
    ``packed.START_COSINE``.
    """
    ax, ay, az, ex, ey, ez = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 19], rows[j, 20], rows[j, 21]
    cx, cy, cz, sx, sy, sz = rows[j, 44], rows[j, 45], rows[j, 46], rows[j, 47], rows[j, 48], rows[j, 49]
    dx, dy, dz, tx, ty, tz = rows[j, 50], rows[j, 51], rows[j, 52], rows[j, 53], rows[j, 54], rows[j, 55]
    fx, fy, fz = rows[j, 23], rows[j, 24], rows[j, 25]  # eq. 1 for a point on the axis
    scale = count / _TURN
    for k in range(16):
        px, py, pz = work[k] - ax, work[16 + k] - ay, work[32 + k] - az
        t = px * ex + py * ey + pz * ez
        wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
        on_axis = wx * wx + wy * wy + wz * wz <= AXIS * AXIS
        wx, wy, wz = fx if on_axis else wx, fy if on_axis else wy, fz if on_axis else wz
        start = angle_of(cx * wx + cy * wy + cz * wz, sx * wx + sy * wy + sz * wz)
        end = angle_of(dx * wx + dy * wy + dz * wz, tx * wx + ty * wy + tz * wz)
        work[RADII + k], work[RADII + 16 + k] = start * scale, end * scale


@no_refcount
def look_up(polar: Array, contour: int, at: float) -> float:
    """Radius at an angle of 0 to A, linear between the given ones."""
    count = polar.shape[1]
    at = at if at < count else 0.0  # rounding can give a full turn; NaN
    k = int(at) & _MOST  # tells the compiler that it is not negative
    share = at - k
    after = k + 1 if k + 1 < count else 0
    radius: float = polar[contour, k] * (1.0 - share) + polar[contour, after] * share
    return radius


@no_refcount
def put_radii(rows: Array, polar: Array, j: int, work: Array) -> None:
    """Write radii of both contours of segment ``j`` in the sections of the 16 points."""
    put_angles(rows, j, float(polar.shape[1]), work)
    for k in range(16):
        work[RADII + k] = look_up(polar, j, work[RADII + k])
        work[RADII + 16 + k] = look_up(polar, j + 1, work[RADII + 16 + k])
