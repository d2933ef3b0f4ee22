"""Exact distances between one segment and 16 triangles, in vector registers.

A block holds 16 triangles as 9 × 16 numbers: the x of all first corners, then their y, and so on. Loops over the 16
lanes have no branch and no call, so that the compiler vectorises them.

The method projects along the line through the segment. The line becomes a point and the triangle becomes planar, so
that their distance is that of a point from three edges. This is exact for slivers and degenerate triangles too, because
the error of a position along a short edge is short.
Distance is convex along the line. If the nearest point of the line lies beyond an end of the segment, that end is
the nearest point of the segment, and the lane gets its distance.
Lanes whose triangle the line crosses are rare; the scalar kernel computes them.
Each result is the distance of two points that lie on segment and triangle, as in ``triangle_kernels``.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..geometry.triangle_kernels import segment_triangle
from ..kernels.compiled import inlined, no_refcount, vectorised

LANES = 16
CORNERS = 9 * LANES  # numbers in a block of triangles
QUERY = 16  # numbers that describe a segment: p, d, two unit vectors perpendicular to d, d / d·d, t where d is zero
WORK = 16 * LANES  # workspace of a block: squared gap, t, point (3), crossing flag; then the columns of ``finish``
COLUMNS = 6 * LANES  # offset of the ten columns of a row: distance, normal, point on the axis, point on the surface

_THIN = 1e-30
_INSCRIBED = 0.1  # 1/12 and an allowance for rounding


@no_refcount
def describe(p: Array, d: Array, query: Array) -> None:
    """Write the constants (QUERY,) of the segment p + t·d, t in [0, 1], that the kernels of a block use."""
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    length = np.sqrt(dd)
    least = 0
    for k in range(3):
        query[k], query[3 + k] = p[k], d[k]
        if abs(d[k]) < abs(d[least]):
            least = k
    if not length > 1e-150:  # a point: there is no line, and the end at t = 0 is the segment
        query[6:15] = 0.0
        query[6], query[10], query[15] = 1.0, 1.0, -1.0
        return
    one, two = (least + 1) % 3, (least + 2) % 3
    across = np.sqrt(d[one] * d[one] + d[two] * d[two])
    query[6 + least] = 0.0
    query[6 + one], query[6 + two] = -d[two] / across, d[one] / across
    x, y, z = d[0] / length, d[1] / length, d[2] / length
    query[9] = y * query[8] - z * query[7]
    query[10] = z * query[6] - x * query[8]
    query[11] = x * query[7] - y * query[6]
    query[12], query[13], query[14], query[15] = x / length, y / length, z / length, 0.0


@vectorised
def _line(corners: Array, query: Array, limit: float, work: Array) -> tuple[int, int]:
    """Nearest points of the line and the edges of each triangle.

    ``work`` gets the squared gap, t on the line, and the triangle's point relative to p (3).

    Returns:
        The number of lanes with t outside [0, 1], and the number of lanes whose triangle the line may cross. Where it
        crosses, an edge is no farther than the radius of the inscribed circle, whose square is at most 1/12 of that of
        the longest edge.
    """
    px, py, pz = query[0], query[1], query[2]
    ex, ey, ez = query[6], query[7], query[8]
    fx, fy, fz = query[9], query[10], query[11]
    hx, hy, hz, t0 = query[12], query[13], query[14], query[15]
    beyond, close = 0, 0
    limit2 = limit * limit
    for j in range(LANES):
        ax, ay, az = corners[j] - px, corners[16 + j] - py, corners[32 + j] - pz
        bx, by, bz = corners[48 + j] - px, corners[64 + j] - py, corners[80 + j] - pz
        cx, cy, cz = corners[96 + j] - px, corners[112 + j] - py, corners[128 + j] - pz
        a1, a2 = ax * ex + ay * ey + az * ez, ax * fx + ay * fy + az * fz
        b1, b2 = bx * ex + by * ey + bz * ez, bx * fx + by * fy + bz * fz
        c1, c2 = cx * ex + cy * ey + cz * ez, cx * fx + cy * fy + cz * fz
        u1, u2, v1, v2, w1, w2 = b1 - a1, b2 - a2, c1 - a1, c2 - a2, c1 - b1, c2 - b2
        uu, vv, ww = u1 * u1 + u2 * u2, v1 * v1 + v2 * v2, w1 * w1 + w2 * w2
        r = -(a1 * u1 + a2 * u2) / (uu if uu > 0.0 else 1.0)
        s = -(a1 * v1 + a2 * v2) / (vv if vv > 0.0 else 1.0)
        k = -(b1 * w1 + b2 * w2) / (ww if ww > 0.0 else 1.0)
        r, s, k = min(max(r, 0.0), 1.0), min(max(s, 0.0), 1.0), min(max(k, 0.0), 1.0)
        x, y = a1 + r * u1, a2 + r * u2
        best = x * x + y * y
        beta, gamma = r, 0.0
        x, y = a1 + s * v1, a2 + s * v2
        gap = x * x + y * y
        near = gap < best
        best, beta, gamma = gap if near else best, 0.0 if near else beta, s if near else gamma
        x, y = b1 + k * w1, b2 + k * w2
        gap = x * x + y * y
        near = gap < best
        best, beta, gamma = gap if near else best, 1.0 - k if near else beta, k if near else gamma
        qx, qy, qz = ax + beta * (bx - ax), ay + beta * (by - ay), az + beta * (bz - az)
        qx, qy, qz = qx + gamma * (cx - ax), qy + gamma * (cy - ay), qz + gamma * (cz - az)
        t = t0 + (qx * hx + qy * hy + qz * hz)
        work[j], work[16 + j] = best, t
        work[32 + j], work[48 + j], work[64 + j] = qx, qy, qz
        beyond += int(((t < 0.0) | (t > 1.0)) & (best <= limit2))
        close += int(best <= _INSCRIBED * max(uu, max(vv, ww)))
    return beyond, close


@vectorised
def _through(corners: Array, query: Array, work: Array) -> int:
    """Flag in ``work`` the triangles that the line crosses, and return their number."""
    px, py, pz = query[0], query[1], query[2]
    ex, ey, ez = query[6], query[7], query[8]
    fx, fy, fz = query[9], query[10], query[11]
    crossed = 0
    for j in range(LANES):
        ax, ay, az = corners[j] - px, corners[16 + j] - py, corners[32 + j] - pz
        bx, by, bz = corners[48 + j] - px, corners[64 + j] - py, corners[80 + j] - pz
        cx, cy, cz = corners[96 + j] - px, corners[112 + j] - py, corners[128 + j] - pz
        a1, a2 = ax * ex + ay * ey + az * ez, ax * fx + ay * fy + az * fz
        b1, b2 = bx * ex + by * ey + bz * ez, bx * fx + by * fy + bz * fz
        c1, c2 = cx * ex + cy * ey + cz * ez, cx * fx + cy * fy + cz * fz
        ab, bc, ca = a1 * b2 - a2 * b1, b1 * c2 - b2 * c1, c1 * a2 - c2 * a1
        through = (ab * bc >= 0.0) & (bc * ca >= 0.0) & (ab * ca >= 0.0)
        work[80 + j] = 1.0 if through else 0.0
        crossed += int(through)
    return crossed


@vectorised
def _ends(corners: Array, query: Array, work: Array) -> None:
    """Lanes with t beyond an end get the triangle's point nearest to that end."""
    px, py, pz, dx, dy, dz = query[0], query[1], query[2], query[3], query[4], query[5]
    for j in range(LANES):
        t = work[16 + j]
        end = 1.0 if t > 1.0 else 0.0
        outside = (t < 0.0) | (t > 1.0)
        ax, ay, az = corners[j] - px, corners[16 + j] - py, corners[32 + j] - pz
        ux, uy, uz = (
            corners[48 + j] - corners[j],
            corners[64 + j] - corners[16 + j],
            corners[80 + j] - corners[32 + j],
        )
        vx, vy, vz = (
            corners[96 + j] - corners[j],
            corners[112 + j] - corners[16 + j],
            corners[128 + j] - corners[32 + j],
        )
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        rx, ry, rz = end * dx - ax, end * dy - ay, end * dz - az
        ox, oy, oz = rx - ux, ry - uy, rz - uz
        uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
        s = (rx * ux + ry * uy + rz * uz) / (uu if uu > 0.0 else 1.0)
        beta, gamma = min(max(s, 0.0), 1.0), 0.0
        gx, gy, gz = rx - beta * ux, ry - beta * uy, rz - beta * uz
        best = gx * gx + gy * gy + gz * gz
        s = (rx * vx + ry * vy + rz * vz) / (vv if vv > 0.0 else 1.0)
        s = min(max(s, 0.0), 1.0)
        gx, gy, gz = rx - s * vx, ry - s * vy, rz - s * vz
        gap = gx * gx + gy * gy + gz * gz
        near = gap < best
        best, beta, gamma = gap if near else best, 0.0 if near else beta, s if near else gamma
        s = (ox * wx + oy * wy + oz * wz) / (ww if ww > 0.0 else 1.0)
        s = min(max(s, 0.0), 1.0)
        gx, gy, gz = ox - s * wx, oy - s * wy, oz - s * wz
        gap = gx * gx + gy * gy + gz * gz
        near = gap < best
        best, beta, gamma = gap if near else best, 1.0 - s if near else beta, s if near else gamma
        # Foot on the face; one refinement restores the digits that the normal of a sliver has lost.
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        nn = nx * nx + ny * ny + nz * nz
        solid = nn > _THIN * uu * vv
        share = 1.0 / (nn if solid else 1.0)
        i = ((ry * vz - rz * vy) * nx + (rz * vx - rx * vz) * ny + (rx * vy - ry * vx) * nz) * share
        k = ((uy * rz - uz * ry) * nx + (uz * rx - ux * rz) * ny + (ux * ry - uy * rx) * nz) * share
        gx, gy, gz = rx - i * ux - k * vx, ry - i * uy - k * vy, rz - i * uz - k * vz
        i = i + ((gy * vz - gz * vy) * nx + (gz * vx - gx * vz) * ny + (gx * vy - gy * vx) * nz) * share
        k = k + ((uy * gz - uz * gy) * nx + (uz * gx - ux * gz) * ny + (ux * gy - uy * gx) * nz) * share
        gx, gy, gz = rx - i * ux - k * vx, ry - i * uy - k * vy, rz - i * uz - k * vz
        gap = gx * gx + gy * gy + gz * gz
        near = solid & (i >= 0.0) & (k >= 0.0) & (i + k <= 1.0) & (gap < best)
        beta, gamma = i if near else beta, k if near else gamma
        work[16 + j] = end if outside else t
        qx, qy, qz = ax + beta * ux + gamma * vx, ay + beta * uy + gamma * vy, az + beta * uz + gamma * vz
        work[32 + j] = qx if outside else work[32 + j]
        work[48 + j] = qy if outside else work[48 + j]
        work[64 + j] = qz if outside else work[64 + j]


@inlined
def _crossed(corners: Array, query: Array, work: Array) -> None:
    """Flagged lanes get the pair of points of the scalar kernel."""
    for j in range(LANES):
        if work[80 + j] != 0.0:
            _, t, x, y, z, _ = segment_triangle(
                query[0], query[1], query[2], query[3], query[4], query[5],
                corners[j], corners[16 + j], corners[32 + j], corners[48 + j], corners[64 + j], corners[80 + j],
                corners[96 + j], corners[112 + j], corners[128 + j],
            )  # fmt: skip
            work[16 + j], work[32 + j], work[48 + j], work[64 + j] = t, x - query[0], y - query[1], z - query[2]


@vectorised
def _gaps(query: Array, limit: float, work: Array) -> int:
    """Write the squared distances, with t clamped to the segment; return how many are within ``limit`` mm."""
    dx, dy, dz = query[3], query[4], query[5]
    limit2 = limit * limit
    within = 0
    for j in range(LANES):
        t = min(max(work[16 + j], 0.0), 1.0)
        gx, gy, gz = t * dx - work[32 + j], t * dy - work[48 + j], t * dz - work[64 + j]
        gap = gx * gx + gy * gy + gz * gz
        work[16 + j], work[j] = t, gap
        within += int(gap <= limit2)
    return within


@no_refcount
def block_gaps(corners: Array, query: Array, limit: float, work: Array) -> int:
    """Number of 16 triangles within ``limit`` mm of the segment's axis; ``work`` gets their exact distances.

    ``work`` (WORK,): 0-15 squared distances in mm², 16-31 t on the segment, 32-79 points on the triangles minus p.
    Lanes beyond ``limit`` hold some squared distance above its square.
    """
    if query[15] < 0.0:  # a point
        work[LANES : 2 * LANES] = -1.0
        _ends(corners, query, work)
        return _gaps(query, limit, work)
    beyond, close = _line(corners, query, limit, work)
    crossed = _through(corners, query, work) if close > 0 else 0
    if crossed > 0:
        _crossed(corners, query, work)
    if beyond > 0 or crossed > 0:
        _ends(corners, query, work)
    return _gaps(query, limit, work)


@vectorised
def finish(query: Array, radius: float, work: Array) -> None:
    """Write the ten columns of each lane's row behind the results of ``block_gaps`` in ``work``."""
    px, py, pz, dx, dy, dz = query[0], query[1], query[2], query[3], query[4], query[5]
    for j in range(LANES):
        t, qx, qy, qz = work[16 + j], work[32 + j], work[48 + j], work[64 + j]
        gx, gy, gz = t * dx - qx, t * dy - qy, t * dz - qz
        distance = np.sqrt(work[j])
        share = 1.0 / (distance if distance > 0.0 else 1.0)
        work[96 + j] = distance - radius
        work[112 + j], work[128 + j], work[144 + j] = gx * share, gy * share, gz * share
        work[160 + j], work[176 + j], work[192 + j] = px + t * dx, py + t * dy, pz + t * dz
        work[208 + j], work[224 + j] = px + qx, py + qy
        work[240 + j] = pz + qz
