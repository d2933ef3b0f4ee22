"""Parts of the compiled query that process 16 points at once: float64, branch-free.

``work`` is the query's scratch memory, WORK numbers: 16 points x, y, z in the patient frame, the results of each,
and the frame of the link.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...kernels.compiled import vectorised
from .query_blocks import RADIUS
from .section import AXIS, EDGE

WORK = 512
GAP = 48  # smallest squared deviation of each of the 16 so far
AT = 64  # and its segment
FRAME = 96  # [R | p] row by row
RADII = 112  # both contours' radii in the sections of the 16
LEVEL = 144  # for each level of the tree: the children's bounds, then the following
STEP = 24
NODE, HERE, LOW, HIGH = 16, 17, 18, 19  # the node, the segment at it and the range around it


@vectorised
def put_places(source: Array, row: int, work: Array) -> None:
    """Transform the 16 points that are stored in a row as x, y, z by the link's frame."""
    a, b, c, p = work[FRAME], work[FRAME + 1], work[FRAME + 2], work[FRAME + 3]
    d, e, f, q = work[FRAME + 4], work[FRAME + 5], work[FRAME + 6], work[FRAME + 7]
    g, h, i, r = work[FRAME + 8], work[FRAME + 9], work[FRAME + 10], work[FRAME + 11]
    for k in range(16):
        x, y, z = source[row, k], source[row, 16 + k], source[row, 32 + k]
        work[k] = a * x + b * y + c * z + p
        work[16 + k] = d * x + e * y + f * z + q
        work[32 + k] = g * x + h * y + i * z + r


@vectorised
def raise_bounds(ball: Array, node: int, rows: Array, j: int, work: Array, at: int) -> None:
    """Raise the bounds of 16 balls to their largest possible deviation between the planes of segment ``j``.

    It is measured from the line below the wall (``inner_line.py``): δ_j ≤ factor · (h - ℓ(t)) in the whole ball.
    """
    ax, ay, az, bx, by, bz = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 3], rows[j, 4], rows[j, 5]
    mx, my, mz, nx, ny, nz = rows[j, 6], rows[j, 7], rows[j, 8], rows[j, 9], rows[j, 10], rows[j, 11]
    ex, ey, ez = rows[j, 19], rows[j, 20], rows[j, 21]
    height, slope, factor = rows[j, 36], rows[j, 37], rows[j, 38]
    steep = abs(slope)
    at &= WORK - 1  # tells the compiler that it is not negative, so that the loop is vectorised
    for k in range(16):
        x, y, z = work[k], work[16 + k], work[32 + k]
        radius = ball[node, RADIUS + k]
        px, py, pz = x - ax, y - ay, z - az
        t = px * ex + py * ey + pz * ez
        wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
        far = np.sqrt(wx * wx + wy * wy + wz * wz) + radius
        above = far - (height + slope * t) + radius * steep
        before = px * mx + py * my + pz * mz + radius
        behind = (bx - x) * nx + (by - y) * ny + (bz - z) * nz + radius
        bound = factor * above if min(above, min(before, behind)) > 0.0 else 0.0
        work[at + k] = max(work[at + k], bound)


@vectorised
def raise_ends(ball: Array, node: int, rows: Array, j: int, end: int, work: Array, at: int) -> None:
    """As ``raise_bounds`` beyond the window's last plane: at most the distance to the rim's farthest point.

    ``end`` is 0 for the plane before segment ``j`` and 1 for the one behind it.
    """
    px, py, pz = rows[j, 3 * end], rows[j, 3 * end + 1], rows[j, 3 * end + 2]
    side = 1.0 - 2.0 * end
    mx, my, mz = side * rows[j, 6 + 3 * end], side * rows[j, 7 + 3 * end], side * rows[j, 8 + 3 * end]
    rim = rows[j, 12 + end]
    at &= WORK - 1
    for k in range(16):
        x, y, z, radius = work[k] - px, work[16 + k] - py, work[32 + k] - pz, ball[node, RADIUS + k]
        far = np.sqrt(x * x + y * y + z * z) + radius + rim
        bound = far if x * mx + y * my + z * mz < radius else 0.0
        work[at + k] = max(work[at + k], bound)


@vectorised
def put_circles(rows: Array, j: int, work: Array) -> None:
    """Write radii of circular contours, equal in every section."""
    radius2, radius3 = rows[j, 12], rows[j, 13]
    for k in range(16):
        work[RADII + k], work[RADII + 16 + k] = radius2, radius3


@vectorised
def lower_gaps(rows: Array, j: int, work: Array) -> None:
    """Reduce the 16 points' squared deviations to that from segment ``j``: ``section.py``, with the radii in RADII.

    Both ends of the wall are multiplied by h, so that no direction is normalised.
    """
    ax, ay, az, ex, ey, ez = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 19], rows[j, 20], rows[j, 21]
    mx, my, mz, nx, ny, nz = rows[j, 6], rows[j, 7], rows[j, 8], rows[j, 9], rows[j, 10], rows[j, 11]
    length, facing2, facing3, lean2, lean3 = rows[j, 22], rows[j, 40], rows[j, 41], rows[j, 42], rows[j, 43]
    segment = float(j)
    for k in range(16):
        px, py, pz = work[k] - ax, work[16 + k] - ay, work[32 + k] - az
        t = px * ex + py * ey + pz * ez
        wx, wy, wz = px - t * ex, py - t * ey, pz - t * ez
        h = np.sqrt(wx * wx + wy * wy + wz * wz)
        scale = h if h > AXIS else 1.0  # eq. 1
        b2 = wx * mx + wy * my + wz * mz if h > AXIS else lean2
        b3 = wx * nx + wy * ny + wz * nz if h > AXIS else lean3
        a2, a3 = facing2 * scale, facing3 * scale
        s2, s3 = np.sqrt(a2 * a2 + b2 * b2), np.sqrt(a3 * a3 + b3 * b3)  # eq. 2
        share = 1.0 / (s2 * s3)
        r2, r3 = work[RADII + k] * s3 * share, work[RADII + 16 + k] * s2 * share
        u2, v2, u3, v3 = -b2 * r2, a2 * r2, length - b3 * r3, a3 * r3  # eq. 3
        du, dv = u3 - u2, v3 - v2
        dd = du * du + dv * dv
        below = du * (v2 - h) - dv * (u2 - t)
        inside = (
            (t * a2 + h * b2 >= -EDGE * s2)
            & ((length - t) * a3 - h * b3 >= -EDGE * s3)
            & ((below >= 0.0) | (below * below <= (EDGE * EDGE) * dd))
        )  # eq. 4-5
        mu = ((t - u2) * du + (h - v2) * dv) / dd  # eq. 6
        mu = mu if mu > 0.0 else 0.0
        mu = mu if mu < 1.0 else 1.0
        gu, gv = u2 + mu * du - t, v2 + mu * dv - h
        gap = 0.0 if inside else gu * gu + gv * gv  # eq. 7, squared
        least = work[GAP + k]
        work[AT + k] = segment if gap < least else work[AT + k]  # eq. 8
        work[GAP + k] = gap if gap < least else least


@vectorised
def most(work: Array, at: int) -> float:
    """Return the largest of 16 non-negative numbers."""
    at &= WORK - 1
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for k in range(0, 16, 4):
        e, f, g, h = work[at + k], work[at + k + 1], work[at + k + 2], work[at + k + 3]
        a, b, c, d = e if e > a else a, f if f > b else b, g if g > c else c, h if h > d else d
    a, b = a if a > c else c, b if b > d else d
    return a if a > b else b
