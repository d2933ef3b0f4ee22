"""Compiled distances and kinematics of the attack's judge, deliberately independent of the engine.

Every candidate distance is that of two points which really lie on segment and triangle, so that inaccuracy near a
degeneracy can only make a candidate too large, never too small; the result is the least candidate.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np

from vfix_engine.arrays import Array, IntArray

Function = TypeVar("Function", bound=Callable[..., Any])


def fast(function: Function) -> Function:
    """Compile a function with IEEE arithmetic."""
    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))


@fast
def _share(px: float, py: float, pz: float, dx: float, dy: float, dz: float, x: float, y: float, z: float) -> float:
    """Return t of the point on the segment p + t·d that is nearest to the point x."""
    dd = dx * dx + dy * dy + dz * dz
    if dd == 0.0:
        return 0.0
    share: float = min(max(((x - px) * dx + (y - py) * dy + (z - pz) * dz) / dd, 0.0), 1.0)
    return share


@fast
def _to_point(px: float, py: float, pz: float, dx: float, dy: float, dz: float, x: float, y: float, z: float) -> float:
    """Return the squared distance of the segment p + t·d and the point x."""
    t = _share(px, py, pz, dx, dy, dz, x, y, z)
    gx, gy, gz = px + t * dx - x, py + t * dy - y, pz + t * dz - z
    return gx * gx + gy * gy + gz * gz


@fast
def _to_edge(
    px: float, py: float, pz: float, dx: float, dy: float, dz: float,
    ax: float, ay: float, az: float, bx: float, by: float, bz: float,
) -> float:  # fmt: skip
    """Return the squared distance of the segments p + t·d and a … b, at an end of one or between inner points."""
    ex, ey, ez = bx - ax, by - ay, bz - az
    best = _to_point(px, py, pz, dx, dy, dz, ax, ay, az)
    best = min(best, _to_point(px, py, pz, dx, dy, dz, bx, by, bz))
    best = min(best, _to_point(ax, ay, az, ex, ey, ez, px, py, pz))
    best = min(best, _to_point(ax, ay, az, ex, ey, ez, px + dx, py + dy, pz + dz))
    dd, ee, de = dx * dx + dy * dy + dz * dz, ex * ex + ey * ey + ez * ez, dx * ex + dy * ey + dz * ez
    whole = dd * ee - de * de
    if whole > 0.0:
        wx, wy, wz = px - ax, py - ay, pz - az
        dw, ew = dx * wx + dy * wy + dz * wz, ex * wx + ey * wy + ez * wz
        t = min(max((de * ew - ee * dw) / whole, 0.0), 1.0)
        # The nearest point of the other segment to that point: a pair of real points, whatever the rounding of t.
        best = min(best, _to_point(ax, ay, az, ex, ey, ez, px + t * dx, py + t * dy, pz + t * dz))
    return best


@fast
def _to_face(x: float, y: float, z: float, c: Array) -> float:
    """Return the squared distance of a point and its foot on the triangle's plane; infinity if that is outside."""
    ux, uy, uz = c[3] - c[0], c[4] - c[1], c[5] - c[2]
    vx, vy, vz = c[6] - c[0], c[7] - c[1], c[8] - c[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    nn = nx * nx + ny * ny + nz * nz
    if nn == 0.0:
        return np.inf
    wx, wy, wz = x - c[0], y - c[1], z - c[2]
    beta = ((wy * vz - wz * vy) * nx + (wz * vx - wx * vz) * ny + (wx * vy - wy * vx) * nz) / nn
    gamma = ((uy * wz - uz * wy) * nx + (uz * wx - ux * wz) * ny + (ux * wy - uy * wx) * nz) / nn
    if not (beta >= 0.0 and gamma >= 0.0 and beta + gamma <= 1.0):
        return np.inf
    gx, gy, gz = wx - beta * ux - gamma * vx, wy - beta * uy - gamma * vy, wz - beta * uz - gamma * vz
    squared: float = gx * gx + gy * gy + gz * gz
    return squared


@fast
def squared_distance(p: Array, d: Array, c: Array) -> float:
    """Return the squared distance of the axis p + t·d, t in [0, 1], and the triangle with the corners c (9,)."""
    px, py, pz, dx, dy, dz = p[0], p[1], p[2], d[0], d[1], d[2]
    best = _to_edge(px, py, pz, dx, dy, dz, c[0], c[1], c[2], c[3], c[4], c[5])
    best = min(best, _to_edge(px, py, pz, dx, dy, dz, c[3], c[4], c[5], c[6], c[7], c[8]))
    best = min(best, _to_edge(px, py, pz, dx, dy, dz, c[6], c[7], c[8], c[0], c[1], c[2]))
    best = min(best, _to_face(px, py, pz, c))
    best = min(best, _to_face(px + dx, py + dy, pz + dz, c))
    nx = (c[4] - c[1]) * (c[8] - c[2]) - (c[5] - c[2]) * (c[7] - c[1])
    ny = (c[5] - c[2]) * (c[6] - c[0]) - (c[3] - c[0]) * (c[8] - c[2])
    nz = (c[3] - c[0]) * (c[7] - c[1]) - (c[4] - c[1]) * (c[6] - c[0])
    climb = dx * nx + dy * ny + dz * nz
    if climb != 0.0:  # where the axis goes through the face
        t = ((c[0] - px) * nx + (c[1] - py) * ny + (c[2] - pz) * nz) / climb
        if 0.0 <= t <= 1.0:
            best = min(best, _to_face(px + t * dx, py + t * dy, pz + t * dz, c))
    return best


@fast
def _to_box(x: float, y: float, z: float, half: Array) -> float:
    """Return the distance of a point and the box −half … half."""
    gx, gy, gz = max(abs(x) - half[0], 0.0), max(abs(y) - half[1], 0.0), max(abs(z) - half[2], 0.0)
    return float(np.sqrt(gx * gx + gy * gy + gz * gz))


@fast
def shape_distance(kind: int, numbers: Array, p: Array, e: Array) -> float:
    """Return the distance of the axis from p to e and a solid shape; 0 if it is entered, except for a half-space.

    kind 0: sphere, centre 3 and radius; 1: capsule, ends 3 + 3 and radius; 2: box, centre 3, axes 3 × 3 row by row,
    half sizes 3; 3: half-space, point 3 and unit normal 3.
    """
    n = numbers
    if kind == 0:
        gap = _to_point(p[0], p[1], p[2], e[0] - p[0], e[1] - p[1], e[2] - p[2], n[0], n[1], n[2])
        return max(float(np.sqrt(gap)) - float(n[3]), 0.0)
    if kind == 1:
        gap = _to_edge(p[0], p[1], p[2], e[0] - p[0], e[1] - p[1], e[2] - p[2], n[0], n[1], n[2], n[3], n[4], n[5])
        return max(float(np.sqrt(gap)) - float(n[6]), 0.0)
    if kind == 3:
        one = (p[0] - n[0]) * n[3] + (p[1] - n[1]) * n[4] + (p[2] - n[2]) * n[5]
        two = (e[0] - n[0]) * n[3] + (e[1] - n[1]) * n[4] + (e[2] - n[2]) * n[5]
        return float(min(one, two))
    a, b = np.empty(3), np.empty(3)
    for i in range(3):
        a[i] = (p[0] - n[0]) * n[3 + 3 * i] + (p[1] - n[1]) * n[4 + 3 * i] + (p[2] - n[2]) * n[5 + 3 * i]
        b[i] = (e[0] - n[0]) * n[3 + 3 * i] + (e[1] - n[1]) * n[4 + 3 * i] + (e[2] - n[2]) * n[5 + 3 * i]
    half = n[12:15]
    low, high = 0.0, 1.0
    for _ in range(90):  # a convex function of the place on the axis: ternary search
        one, two = low + (high - low) / 3.0, high - (high - low) / 3.0
        at_one = _to_box(a[0] + one * (b[0] - a[0]), a[1] + one * (b[1] - a[1]), a[2] + one * (b[2] - a[2]), half)
        at_two = _to_box(a[0] + two * (b[0] - a[0]), a[1] + two * (b[1] - a[1]), a[2] + two * (b[2] - a[2]), half)
        if at_one <= at_two:
            high = two
        else:
            low = one
    middle = 0.5 * (low + high)
    best = _to_box(a[0] + middle * (b[0] - a[0]), a[1] + middle * (b[1] - a[1]), a[2] + middle * (b[2] - a[2]), half)
    return min(best, min(_to_box(a[0], a[1], a[2], half), _to_box(b[0], b[1], b[2], half)))


@fast
def shape_replay(
    revolute: Array, axis: Array, point: Array, home: Array, before: Array, after: Array, parts: int,
    kind: int, numbers: Array, radius: Array, worst: Array,
) -> None:  # fmt: skip
    """Write the least distance (S,) of each capsule to a shape over the poses between into ``worst``, as ``replay``."""
    places, q = np.empty_like(home), np.empty(len(before))
    for part in range(1, parts):
        share = part / parts
        for j in range(len(q)):
            q[j] = before[j] + share * (after[j] - before[j])
        place(revolute, axis, point, home, q, places)
        for s in range(len(radius)):
            gap = shape_distance(kind, numbers, places[2 * s], places[2 * s + 1]) - radius[s]
            worst[s] = min(worst[s], gap)


@fast
def gather(corners: Array, spheres: Array, among: IntArray, places: Array, radius: Array, reach: float) -> IntArray:
    """Return the triangles of ``among`` whose bounding sphere is within ``reach`` of a capsule's surface.

    places (2 S, 3): start and end of every axis in turn.
    """
    found = np.empty(len(among), np.int64)
    count = 0
    for i in among:
        for s in range(len(radius)):
            p, e = places[2 * s], places[2 * s + 1]
            far = reach + radius[s] + spheres[i, 3]
            near = _to_point(
                p[0], p[1], p[2], e[0] - p[0], e[1] - p[1], e[2] - p[2], spheres[i, 0], spheres[i, 1], spheres[i, 2]
            )
            if near <= far * far:
                found[count] = i
                count += 1
                break
    return found[:count].copy()


@fast
def least_distance(
    corners: Array, spheres: Array, places: Array, radius: Array, cap: float, least: Array, nearest: IntArray
) -> None:
    """Write the least distance (S,) of every capsule to these triangles, at most ``cap``, and the nearest triangle.

    Brute force: a triangle is skipped only if its bounding sphere is further away than the least distance so far.
    """
    d = np.empty(3)
    for s in range(len(radius)):
        p = places[2 * s]
        for k in range(3):
            d[k] = places[2 * s + 1, k] - p[k]
        best = cap + radius[s]
        nearest[s] = -1
        for i in range(len(corners)):
            far = best + spheres[i, 3]
            near = _to_point(p[0], p[1], p[2], d[0], d[1], d[2], spheres[i, 0], spheres[i, 1], spheres[i, 2])
            if near <= far * far:
                gap = np.sqrt(squared_distance(p, d, corners[i]))
                if gap < best:
                    best, nearest[s] = gap, i
        least[s] = best - radius[s]


@fast
def place(revolute: Array, axis: Array, point: Array, home: Array, q: Array, places: Array) -> None:
    """Write the ends of the axes (2 S, 3) at joints q, by a product of exponentials of screws (Brockett).

    The outermost joint comes first. axis (n, 3): unit vectors. point (n, 3): on the axis of a revolute joint. home: the
    ends at q = 0. All in the patient frame.
    """
    places[:] = home
    for j in range(len(q) - 1, -1, -1):
        x, y, z = axis[j, 0], axis[j, 1], axis[j, 2]
        if revolute[j] == 0.0:
            for i in range(len(places)):
                places[i, 0] += q[j] * x
                places[i, 1] += q[j] * y
                places[i, 2] += q[j] * z
            continue
        sine, versed = np.sin(q[j]), 2.0 * np.sin(0.5 * q[j]) ** 2
        for i in range(len(places)):
            rx, ry, rz = places[i, 0] - point[j, 0], places[i, 1] - point[j, 1], places[i, 2] - point[j, 2]
            cx, cy, cz = y * rz - z * ry, z * rx - x * rz, x * ry - y * rx
            places[i, 0] += sine * cx + versed * (y * cz - z * cy)
            places[i, 1] += sine * cy + versed * (z * cx - x * cz)
            places[i, 2] += sine * cz + versed * (x * cy - y * cx)


@fast
def furthest(one: Array, two: Array) -> float:
    """Return the longest distance of a point of ``one`` (n, 3) to that of ``two``; not finite if a point is not."""
    most = 0.0
    for i in range(len(one)):
        x, y, z = two[i, 0] - one[i, 0], two[i, 1] - one[i, 1], two[i, 2] - one[i, 2]
        way = float(np.sqrt(x * x + y * y + z * z))
        if not np.isfinite(way):
            return way
        most = max(most, way)
    return most


@fast
def replay(
    revolute: Array, axis: Array, point: Array, home: Array, before: Array, after: Array, parts: int,
    corners: Array, spheres: Array, radius: Array, anchor: Array, reach: float, cap: float,
    first: int, least: Array, nearest: IntArray, worst: Array,
) -> int:  # fmt: skip
    """Write the least distance (S,) of each capsule over ``parts`` poses between two joint states into ``worst``.

    The triangles are all within ``reach`` of the tool at ``anchor`` (2 S, 3).
    Returns ``parts`` when done, or the part at which the tool leaves the region that the triangles cover.
    """
    places, q = np.empty_like(home), np.empty(len(before))
    for part in range(first, parts):
        share = part / parts
        for j in range(len(q)):
            q[j] = before[j] + share * (after[j] - before[j])
        place(revolute, axis, point, home, q, places)
        if not furthest(anchor, places) + cap <= reach - 1e-6:
            return part
        least_distance(corners, spheres, places, radius, cap, least, nearest)
        for s in range(len(radius)):
            worst[s] = min(worst[s], least[s])
    return parts
