"""Closest points between a segment and a triangle, compiled.

The distance is smallest where the segment crosses the face, at an end of the segment above the face, or on an edge of
the triangle. Each case yields a pair of points on segment and triangle, and the nearest pair is the result.
Near a degeneracy a case can be missed, but every result is the distance of an actual pair of points (HAZ-08).
"""

from __future__ import annotations

from ..kernels.compiled import compiled, inlined

# Squared sine of a corner below which the triangle's normal is too inaccurate to reject a case.
_THIN = 1e-6


@compiled
def _clamp(value: float) -> float:
    return min(max(value, 0.0), 1.0)


@compiled
def edge_pair(
    dx: float, dy: float, dz: float, ax: float, ay: float, az: float, ex: float, ey: float, ez: float
) -> tuple[float, float, float]:
    """Closest points of the segments t·d and a + s·e, t and s in [0, 1]: (squared distance, t, s)."""
    dd = dx * dx + dy * dy + dz * dz
    ee = ex * ex + ey * ey + ez * ez
    # The cross product is accurate for nearly parallel directions, dd·ee − (d·e)² is not.
    nx, ny, nz = dy * ez - dz * ey, dz * ex - dx * ez, dx * ey - dy * ex
    nn = nx * nx + ny * ny + nz * nz
    t = 0.0
    if nn > 1e-30 * dd * ee:
        t = _clamp(((ay * ez - az * ey) * nx + (az * ex - ax * ez) * ny + (ax * ey - ay * ex) * nz) / nn)
    s = 0.0
    if ee > 0.0:
        s = _clamp(((t * dx - ax) * ex + (t * dy - ay) * ey + (t * dz - az) * ez) / ee)
    if dd > 0.0:
        t = _clamp(((ax + s * ex) * dx + (ay + s * ey) * dy + (az + s * ez) * dz) / dd)
    gx, gy, gz = t * dx - ax - s * ex, t * dy - ay - s * ey, t * dz - az - s * ez
    return gx * gx + gy * gy + gz * gz, t, s


@inlined
def face_point(
    rx: float, ry: float, rz: float, ux: float, uy: float, uz: float, vx: float, vy: float, vz: float,
    nx: float, ny: float, nz: float, nn: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Foot of the point r on the plane of the triangle (0, u, v) with normal n = u × v, nn = n·n > 0.

    Returns (squared distance, α, β) with the foot α·u + β·v; ∞ if the foot lies outside.
    """
    alpha = ((ry * vz - rz * vy) * nx + (rz * vx - rx * vz) * ny + (rx * vy - ry * vx) * nz) / nn
    beta = ((uy * rz - uz * ry) * nx + (uz * rx - ux * rz) * ny + (ux * ry - uy * rx) * nz) / nn
    gx, gy, gz = rx - alpha * ux - beta * vx, ry - alpha * uy - beta * vy, rz - alpha * uz - beta * vz
    if nn < _THIN * (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz):
        # One refinement restores the digits that the normal of a sliver has lost.
        alpha += ((gy * vz - gz * vy) * nx + (gz * vx - gx * vz) * ny + (gx * vy - gy * vx) * nz) / nn
        beta += ((uy * gz - uz * gy) * nx + (uz * gx - ux * gz) * ny + (ux * gy - uy * gx) * nz) / nn
        gx, gy, gz = rx - alpha * ux - beta * vx, ry - alpha * uy - beta * vy, rz - alpha * uz - beta * vz
    if alpha >= 0.0 and beta >= 0.0 and alpha + beta <= 1.0:
        return gx * gx + gy * gy + gz * gz, alpha, beta
    return float("inf"), 0.0, 0.0


@compiled
def segment_triangle(
    px: float, py: float, pz: float, dx: float, dy: float, dz: float,
    x0: float, y0: float, z0: float, x1: float, y1: float, z1: float, x2: float, y2: float, z2: float,
) -> tuple[float, float, float, float, float, bool]:  # fmt: skip
    """Closest points of the segment p + t·d, t in [0, 1], and a triangle given by its corners (mm).

    Returns (squared distance, t, point on the triangle x, y, z, whether the segment crosses the face).
    Segments of zero length and triangles without area are allowed.
    """
    # Relative to p, to keep precision far from the origin.
    ax, ay, az = x0 - px, y0 - py, z0 - pz
    ux, uy, uz = x1 - x0, y1 - y0, z1 - z0
    vx, vy, vz = x2 - x0, y2 - y0, z2 - z0
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    uu, vv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    thin = nn < _THIN * uu * vv
    height = -(ax * nx + ay * ny + az * nz)  # of p above the plane, times |n|
    climb = dx * nx + dy * ny + dz * nz
    solid = nn > 1e-30 * uu * vv
    best, bt, bx, by, bz = float("inf"), 0.0, 0.0, 0.0, 0.0
    if solid and climb != 0.0 and (thin or height * (height + climb) <= 0.0):
        t = _clamp(-height / climb)
        gap, alpha, beta = face_point(
            t * dx - ax, t * dy - ay, t * dz - az, ux, uy, uz, vx, vy, vz, nx, ny, nz, nn
        )  # fmt: skip
        if gap < best:
            best, bt = gap, t
            bx, by, bz = x0 + alpha * ux + beta * vx, y0 + alpha * uy + beta * vy, z0 + alpha * uz + beta * vz
            if not thin:
                return best, bt, bx, by, bz, True
    gap, t, s = edge_pair(dx, dy, dz, ax, ay, az, ux, uy, uz)
    if gap < best:
        best, bt, bx, by, bz = gap, t, x0 + s * ux, y0 + s * uy, z0 + s * uz
    gap, t, s = edge_pair(dx, dy, dz, ax, ay, az, vx, vy, vz)
    if gap < best:
        best, bt, bx, by, bz = gap, t, x0 + s * vx, y0 + s * vy, z0 + s * vz
    gap, t, s = edge_pair(dx, dy, dz, x1 - px, y1 - py, z1 - pz, x2 - x1, y2 - y1, z2 - z1)
    if gap < best:
        best, bt, bx, by, bz = gap, t, x1 + s * (x2 - x1), y1 + s * (y2 - y1), z1 + s * (z2 - z1)
    if solid:
        for end in range(2):
            over = height + end * climb
            if thin or over * over < best * nn:
                gap, alpha, beta = face_point(
                    end * dx - ax, end * dy - ay, end * dz - az, ux, uy, uz, vx, vy, vz, nx, ny, nz, nn
                )  # fmt: skip
                if gap < best:
                    best, bt = gap, float(end)
                    bx, by, bz = x0 + alpha * ux + beta * vx, y0 + alpha * uy + beta * vy, z0 + alpha * uz + beta * vz
    return best, bt, bx, by, bz, False


@compiled
def segment_point(
    px: float, py: float, pz: float, dx: float, dy: float, dz: float, dd: float, x: float, y: float, z: float
) -> float:
    """Squared distance from a point to the segment p + t·d, dd = d·d."""
    gx, gy, gz = x - px, y - py, z - pz
    if dd > 0.0:
        t = _clamp((gx * dx + gy * dy + gz * dz) / dd)
        gx, gy, gz = gx - t * dx, gy - t * dy, gz - t * dz
    return gx * gx + gy * gy + gz * gz
