"""Exact closest pairs between a capsule of the tool and a solid shape, compiled.

The distance is signed: outside it is the smallest distance, inside it is minus the penetration depth, the length of the
shortest translation that separates the two. Both are

    max over unit vectors u of ( min over t of u·x(t) − h(u) ) − radius,

with x(t) the axis and h the support function of the shape. For each u the bracket is 1-Lipschitz in the motion of the
ends of the axis, hence so is the maximum. The certificate's bound between two poses therefore holds for shapes as for
triangles, inside and outside.
The normal is the maximising u, the gradient of the distance; it is a unit vector also where the axis enters the shape.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled
from .shapes import BOX, CAPSULE, SPHERE
from .triangle_kernels import edge_pair

_COINCIDENT = 1e-9  # mm; below it the direction between two points is dominated by rounding


@compiled
def shape_row(kind: int, data: Array, p: Array, d: Array, radius: float, row: Array) -> None:
    """Write the closest pair of the capsule p + t·d, t in [0, 1], and one shape.

    Args:
        kind, data: one row of a ``ShapeTable``, scalar and (16,).
        p, d: start (3,) and extent (3,) of the axis in mm, patient frame; d may be zero.
        radius: of the tool's capsule in mm.
        row: output (10,), as in ``rows_kernel``: signed distance, unit normal 3 from the shape to the axis, point on
            the axis 3, point on the shape's surface 3; distance = normal · (on_tool − on_surface) − radius.
    """
    if kind == SPHERE:
        gap, t = _sphere_row(data, p, d, row)
    elif kind == CAPSULE:
        gap, t = _capsule_row(data, p, d, row)
    elif kind == BOX:
        gap, t = _box_row(data, p, d, row)
    else:
        gap, t = _half_space_row(data, p, d, row)
    row[0] = gap - radius
    for i in range(3):
        row[4 + i] = p[i] + t * d[i]
        row[7 + i] = row[4 + i] - gap * row[1 + i]


@compiled
def shape_rows(
    kind: int, data: Array, p: Array, d: Array, radius: float, threshold: float, rows: Array, found: int
) -> tuple[int, float]:
    """Append the pairs of one capsule and one shape within ``threshold`` mm: the closest pair, and those of both ends.

    A capsule along a face touches it over its whole length; the rows of its ends prevent it from rotating into the
    face.

    Args:
        rows: output (m, 10) with space for three rows from ``found`` on.

    Returns:
        The number of rows, and the distance of the closest pair, independent of the threshold.
    """
    closest = rows[found]
    shape_row(kind, data, p, d, radius, closest)
    least = closest[0]
    if not least <= threshold:
        return found, least
    found += 1
    none, end = np.zeros(3), np.empty(3)
    for k in range(2):
        away = 0.0
        for i in range(3):
            end[i] = p[i] + k * d[i]
            away += abs(end[i] - closest[4 + i])
        if away > _COINCIDENT:
            shape_row(kind, data, end, none, radius, rows[found])
            if rows[found, 0] <= threshold:
                found += 1
    return found, least


@compiled
def across(d: Array, row: Array) -> None:
    """Write a unit vector perpendicular to d as the row's normal; any unit vector if d is zero."""
    least = 0
    for i in range(1, 3):
        if abs(d[i]) < abs(d[least]):
            least = i
    one, two = (least + 1) % 3, (least + 2) % 3
    size = np.sqrt(d[one] * d[one] + d[two] * d[two])
    row[1 + least] = 0.0
    if size > 0.0:
        row[1 + one], row[1 + two] = -d[two] / size, d[one] / size
    else:
        row[1 + one], row[1 + two] = 1.0, 0.0


@compiled
def _sphere_row(data: Array, p: Array, d: Array, row: Array) -> tuple[float, float]:
    """Write the normal; return the signed distance of the axis and its t."""
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    gx, gy, gz = p[0] - data[0], p[1] - data[1], p[2] - data[2]
    t = 0.0
    if dd > 0.0:
        t = min(max(-(gx * d[0] + gy * d[1] + gz * d[2]) / dd, 0.0), 1.0)
        gx, gy, gz = gx + t * d[0], gy + t * d[1], gz + t * d[2]
    size = np.sqrt(gx * gx + gy * gy + gz * gz)
    if size < _COINCIDENT:
        across(d, row)
    else:
        row[1], row[2], row[3] = gx / size, gy / size, gz / size
    return size - data[3], t


@compiled
def _capsule_row(data: Array, p: Array, d: Array, row: Array) -> tuple[float, float]:
    ax, ay, az = data[0] - p[0], data[1] - p[1], data[2] - p[2]
    ex, ey, ez = data[3], data[4], data[5]
    squared, t, s = edge_pair(d[0], d[1], d[2], ax, ay, az, ex, ey, ez)
    size = np.sqrt(squared)
    if size < _COINCIDENT:
        # The shortest separation is perpendicular to both axes; if they are parallel, or one is a point, to the longer.
        nx, ny, nz = d[1] * ez - d[2] * ey, d[2] * ex - d[0] * ez, d[0] * ey - d[1] * ex
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        ee = ex * ex + ey * ey + ez * ez
        if length > 1e-12 * np.sqrt(dd * ee):
            row[1], row[2], row[3] = nx / length, ny / length, nz / length
        else:
            across(d if dd > ee else data[3:6], row)
    else:
        row[1] = (t * d[0] - ax - s * ex) / size
        row[2] = (t * d[1] - ay - s * ey) / size
        row[3] = (t * d[2] - az - s * ez) / size
    return size - data[6], t


@compiled
def _half_space_row(data: Array, p: Array, d: Array, row: Array) -> tuple[float, float]:
    row[1], row[2], row[3] = data[0], data[1], data[2]
    height = p[0] * data[0] + p[1] * data[1] + p[2] * data[2] - data[3]
    climb = d[0] * data[0] + d[1] * data[1] + d[2] * data[2]
    if climb < 0.0:
        return height + climb, 1.0
    return height, 0.0


@compiled
def _box_row(data: Array, p: Array, d: Array, row: Array) -> tuple[float, float]:
    start, along, normal = np.empty(3), np.empty(3), np.empty(3)  # in the box's frame
    half = data[12:15]
    for i in range(3):
        start[i] = along[i] = 0.0
        for j in range(3):
            start[i] += data[3 + 3 * j + i] * (p[j] - data[j])
            along[i] += data[3 + 3 * j + i] * d[j]
    t = _nearest_to_box(start, along, half)
    squared = 0.0
    for i in range(3):
        x = start[i] + t * along[i]
        normal[i] = x - min(max(x, -half[i]), half[i])
        squared += normal[i] * normal[i]
    gap = np.sqrt(squared)
    if gap < _COINCIDENT:
        gap, t = _separation(start, along, half, normal)
    else:
        for i in range(3):
            normal[i] /= gap
    for i in range(3):
        row[1 + i] = data[3 + 3 * i] * normal[0] + data[4 + 3 * i] * normal[1] + data[5 + 3 * i] * normal[2]
    return gap, t


@compiled
def _half_derivative(t: float, start: Array, along: Array, half: Array) -> float:
    """Half the derivative of the squared distance to the box at t."""
    slope = 0.0
    for i in range(3):
        x = start[i] + t * along[i]
        slope += (x - min(max(x, -half[i]), half[i])) * along[i]
    return slope


@compiled
def _nearest_to_box(start: Array, along: Array, half: Array) -> float:
    """t of the axis point nearest to the box: the squared distance is convex, its derivative linear between faces."""
    low, high = 0.0, 1.0
    low_slope, high_slope = _half_derivative(0.0, start, along, half), _half_derivative(1.0, start, along, half)
    if low_slope >= 0.0:
        return 0.0
    if high_slope <= 0.0:
        return 1.0
    for i in range(3):
        for sign in range(-1, 2, 2):
            if along[i] != 0.0:
                t = (sign * half[i] - start[i]) / along[i]
                if low < t < high:
                    slope = _half_derivative(t, start, along, half)
                    if slope < 0.0:
                        low, low_slope = t, slope
                    else:
                        high, high_slope = t, slope
    return min(max(low - (high - low) * low_slope / (high_slope - low_slope), low), high)


@compiled
def _separation(start: Array, along: Array, half: Array, normal: Array) -> tuple[float, float]:
    """Minus the penetration depth of an axis that enters the box, with its direction in ``normal``, and t.

    The Minkowski difference of box and axis is a polytope. Its face normals are the box's axes and their cross products
    with the tool's axis.
    """
    best, best_t = -np.inf, 0.0
    for i in range(3):
        a, b = start[i], start[i] + along[i]
        for sign in range(-1, 2, 2):
            near = min(sign * a, sign * b) - half[i]
            if near > best:
                best, best_t = near, (0.0 if sign * a <= sign * b else 1.0)
                normal[0] = normal[1] = normal[2] = 0.0
                normal[i] = float(sign)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        size = np.sqrt(along[j] * along[j] + along[k] * along[k])
        total = np.sqrt(size * size + along[i] * along[i])
        if size <= 1e-14 * total or total == 0.0:
            continue
        u_j, u_k = -along[k] / size, along[j] / size
        height = u_j * start[j] + u_k * start[k]
        if height < 0.0:
            height, u_j, u_k = -height, -u_j, -u_k
        near = height - half[j] * abs(u_j) - half[k] * abs(u_k)
        if near > best:
            edge_j, edge_k = (half[j] if u_j > 0.0 else -half[j]), (half[k] if u_k > 0.0 else -half[k])
            miss_j, miss_k = start[j] - near * u_j - edge_j, start[k] - near * u_k - edge_k
            best = near
            best_t = min(max(-(miss_j * along[j] + miss_k * along[k]) / (size * size), 0.0), 1.0)
            normal[i], normal[j], normal[k] = 0.0, u_j, u_k
    return best, best_t
