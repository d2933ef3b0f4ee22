"""Kernels of signed distance fields on cubic grids: border points, nearest border point, interpolation (compiled).

Grids are indexed [k, j, i]; positions in grid units are (i, j, k).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kernels.compiled import compiled, inlined, nogil

_BEYOND = 0.99  # largest 1 / steps to a border that is not within one step
_LEAST_SHARE = 1e-3  # of a step: smallest distance of a border from a grid point
_EDGE = 1e-6  # [grid step] tolerance beyond the outermost points for rounding of the mapping


@inlined
def _slope(own: float, ahead: float, behind: float) -> float:
    """Return 1 / steps from a grid point to the border along one axis, negative if the border lies behind.

    Without a border within one step it is estimated from the slope of the level.
    """
    least, slope = 2.0, 0.0
    if (own > 0.0) != (ahead > 0.0) and ahead == ahead:
        least = max(own / (own - ahead), _LEAST_SHARE)
        slope = 1.0 / least
    if (own > 0.0) != (behind > 0.0) and behind == behind:
        back = max(own / (own - behind), _LEAST_SHARE)
        if back < least:
            least, slope = back, -1.0 / back
    if least == 2.0 and own != 0.0 and ahead == ahead and behind == behind:
        slope = min(max((behind - ahead) / (2.0 * own), -_BEYOND), _BEYOND)
    return slope


@inlined
def _foot(level: Any, k: int, j: int, i: int, foot: Any) -> bool:
    """Write the border point (i, j, k) nearest to a grid point next to the border, and the unit direction to it.

    The border is a plane through the zeros of the level on the grid's edges, as marching cubes places them. Returns
    False if no edge from the point crosses the border.
    """
    top_k, top_j, top_i = level.shape[0] - 1, level.shape[1] - 1, level.shape[2] - 1
    own = level[k, j, i]
    a = _slope(own, level[k, j, min(i + 1, top_i)], level[k, j, max(i - 1, 0)])
    b = _slope(own, level[k, min(j + 1, top_j), i], level[k, max(j - 1, 0), i])
    c = _slope(own, level[min(k + 1, top_k), j, i], level[max(k - 1, 0), j, i])
    if max(abs(a), abs(b), abs(c)) < 1.0:
        return False
    size = np.sqrt(a * a + b * b + c * c)
    foot[3], foot[4], foot[5] = a / size, b / size, c / size
    foot[0], foot[1], foot[2] = i + foot[3] / size, j + foot[4] / size, k + foot[5] / size
    return True


@nogil
def border_feet(level: Any, nearest: Any) -> Any:
    """Border points and unit normals (m, 6) next to the grid points of a level (K, J, I), which is NaN where unknown.

    nearest (K, J, I) int32: set to the row of its border point at each grid point next to the border, -1 elsewhere.
    """
    count_k, count_j, count_i = level.shape
    foot, count = np.empty(6), 0
    for k in range(count_k):
        for j in range(count_j):
            for i in range(count_i):
                nearest[k, j, i] = -1
                if level[k, j, i] == level[k, j, i] and _foot(level, k, j, i, foot):
                    nearest[k, j, i] = count
                    count += 1
    feet = np.empty((count, 6), np.float32)
    for k in range(count_k):
        for j in range(count_j):
            for i in range(count_i):
                if nearest[k, j, i] >= 0:
                    _foot(level, k, j, i, foot)
                    feet[nearest[k, j, i]] = foot
    return feet


@inlined
def _squared(feet: Any, row: int, x: int, y: int, z: int) -> float:
    """Squared distance from a grid point to a border point, grid units."""
    a, b, c = feet[row, 0] - x, feet[row, 1] - y, feet[row, 2] - z
    return float(a * a + b * b + c * c)


@nogil
def spread(nearest: Any, feet: Any) -> None:
    """Assign to each grid point its nearest border point, propagated between neighbours in eight sweeps.

    nearest (K, J, I) int32: rows of border points, -1 where unknown. feet (m, 6) float32: border points in grid units,
    and unit normals. This is the vector distance transform of Danielsson 1980, "Euclidean distance mapping", Computer
    Graphics and Image Processing 14(3), with border points between the grid points.
    """
    count_k, count_j, count_i = nearest.shape
    for sweep in range(8):
        dk, dj, di = 1 - 2 * (sweep & 1), 1 - (sweep & 2), 1 - (sweep & 4) // 2
        for step_k in range(count_k):
            k = step_k if dk > 0 else count_k - 1 - step_k
            for step_j in range(count_j):
                j = step_j if dj > 0 else count_j - 1 - step_j
                for step_i in range(count_i):
                    i = step_i if di > 0 else count_i - 1 - step_i
                    row = nearest[k, j, i]
                    best = np.inf if row < 0 else _squared(feet, row, i, j, k)
                    for axis in range(3):
                        if axis == 0:
                            other = nearest[k, j, i - di] if step_i > 0 else -1
                        elif axis == 1:
                            other = nearest[k, j - dj, i] if step_j > 0 else -1
                        else:
                            other = nearest[k - dk, j, i] if step_k > 0 else -1
                        if other >= 0 and other != row:
                            found = _squared(feet, other, i, j, k)
                            if found < best:
                                best, row = found, other
                    nearest[k, j, i] = row


@nogil
def distances(nearest: Any, feet: Any, step: float, disc: float) -> Any:
    """Distance (K, J, I) float32 in mm from each grid point to the border; `step` is the grid spacing in mm.

    disc: radius, in steps, of the disc of border that a border point represents. The distance to the point alone is
        too large for most grid points, whose nearest border lies between two border points.
    """
    count_k, count_j, count_i = nearest.shape
    values = np.empty(nearest.shape, np.float32)
    for k in range(count_k):
        for j in range(count_j):
            for i in range(count_i):
                row = nearest[k, j, i]
                if row < 0:
                    values[k, j, i] = np.inf
                    continue
                x, y, z = i - feet[row, 0], j - feet[row, 1], k - feet[row, 2]
                along = x * feet[row, 3] + y * feet[row, 4] + z * feet[row, 5]
                across = np.sqrt(max(x * x + y * y + z * z - along * along, 0.0))
                across = max(across - disc, 0.0)
                values[k, j, i] = step * np.sqrt(along * along + across * across)
    return values


@inlined
def _cell(values: Any, x: float, y: float, z: float, out: Any) -> None:
    """Write the trilinear value and its derivative along i, j, k at a position in grid units; NaN outside the grid."""
    top_k, top_j, top_i = values.shape[0] - 1, values.shape[1] - 1, values.shape[2] - 1
    if not (-_EDGE <= x <= top_i + _EDGE and -_EDGE <= y <= top_j + _EDGE and -_EDGE <= z <= top_k + _EDGE):
        out[0] = out[1] = out[2] = out[3] = np.nan
        return
    i = min(max(int(x), 0), top_i - 1)
    j = min(max(int(y), 0), top_j - 1)
    k = min(max(int(z), 0), top_k - 1)
    a, b, c = x - i, y - j, z - k
    v000, v001, v010, v011 = values[k, j, i], values[k, j, i + 1], values[k, j + 1, i], values[k, j + 1, i + 1]
    k += 1
    v100, v101, v110, v111 = values[k, j, i], values[k, j, i + 1], values[k, j + 1, i], values[k, j + 1, i + 1]
    v00, v01 = v000 + a * (v001 - v000), v010 + a * (v011 - v010)
    v10, v11 = v100 + a * (v101 - v100), v110 + a * (v111 - v110)
    v0, v1 = v00 + b * (v01 - v00), v10 + b * (v11 - v10)
    out[0] = v0 + c * (v1 - v0)
    front, back = v001 - v000 + b * (v011 - v010 - v001 + v000), v101 - v100 + b * (v111 - v110 - v101 + v100)
    out[1] = front + c * (back - front)
    out[2] = (v01 - v00) * (1 - c) + (v11 - v10) * c
    out[3] = v1 - v0


@compiled
def interpolate(values: Any, origin: Any, step: float, points: Any, found: Any) -> None:
    """Fill the rows of `found` that are still NaN with the trilinear value and, in three more columns, its gradient.

    values (K, J, I) float32; origin (3,) and points (n, 3) mm; found (n, 1) or (n, 4): mm, and mm per mm.
    """
    cell = np.empty(4)
    for n in range(points.shape[0]):
        if found[n, 0] == found[n, 0]:
            continue
        x, y = (points[n, 0] - origin[0]) / step, (points[n, 1] - origin[1]) / step
        _cell(values, x, y, (points[n, 2] - origin[2]) / step, cell)
        found[n, 0] = cell[0]
        for axis in range(1, found.shape[1]):
            found[n, axis] = cell[axis] / step


@nogil
def limit(
    values: Any, origin: Any, step: float, whole: Any, whole_origin: Any, whole_step: float, limited: Any
) -> None:
    """Limit distances (K, J, I) that exceed the distance to the side of their grid to those of another grid there.

    The sign stays. limited (K, J, I) bool: points that an earlier grid knew, which are left as they are; updated.
    """
    count_k, count_j, count_i = values.shape
    cell = np.empty(4)
    for k in range(count_k):
        for j in range(count_j):
            for i in range(count_i):
                own = np.float64(values[k, j, i])
                to_side = min(k, count_k - 1 - k, j, count_j - 1 - j, i, count_i - 1 - i) * step
                if limited[k, j, i] or not abs(own) > to_side:
                    continue
                x = (origin[0] + step * i - whole_origin[0]) / whole_step
                y = (origin[1] + step * j - whole_origin[1]) / whole_step
                _cell(whole, x, y, (origin[2] + step * k - whole_origin[2]) / whole_step, cell)
                if cell[0] == cell[0]:
                    limited[k, j, i] = True
                    values[k, j, i] = np.copysign(min(abs(own), abs(cell[0])), own)
