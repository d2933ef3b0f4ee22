"""Rows (10,) of closest pairs, compiled: distance, normal (3), point on the axis (3), point on the surface (3)."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Int32Array
from ..geometry.shape_kernels import across
from ..geometry.triangle_kernels import segment_point, segment_triangle
from ..kernels.compiled import compiled

_COINCIDENT = 1e-9  # mm; below it the direction between two points is dominated by rounding


@compiled
def fits(p: Array, d: Array, dd: float, sphere: Array, limit: float) -> bool:
    """Whether a triangle's sphere (4,) comes within ``limit`` of the segment p + t·d, dd = d·d."""
    reach = limit + sphere[3]
    gap = segment_point(p[0], p[1], p[2], d[0], d[1], d[2], dd, sphere[0], sphere[1], sphere[2])
    near: bool = gap <= reach * reach * (1.0 + 1e-12)
    return near


@compiled
def widened(rows: Array, labels: Int32Array) -> tuple[Array, Int32Array]:
    """Return the same rows with twice the capacity."""
    count = len(rows)
    more_rows, more_labels = np.empty((2 * count, 10)), np.empty((2 * count, 2), np.int32)
    for i in range(count):  # without slices, whose error handling takes a second to compile
        for k in range(10):
            more_rows[i, k] = rows[i, k]
        more_labels[i, 0], more_labels[i, 1] = labels[i, 0], labels[i, 1]
    return more_rows, more_labels


@compiled
def own_normal(d: Array, normal: Array, row: Array) -> None:
    """Write the triangle's normal into the row; without an area, any direction perpendicular to the segment."""
    if normal[0] != 0.0 or normal[1] != 0.0 or normal[2] != 0.0:
        row[1], row[2], row[3] = normal[0], normal[1], normal[2]
        return
    across(d, row)


@compiled
def write_row(p: Array, d: Array, radius: float, limit: float, c: Array, normal: Array, row: Array) -> bool:
    """Write the pair of the segment p + t·d and the triangle with corners c (9,); False beyond ``limit`` mm."""
    gap, t, x, y, z, crosses = segment_triangle(
        p[0], p[1], p[2], d[0], d[1], d[2], c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
    )
    if gap > limit * limit:
        return False
    distance = np.sqrt(gap)
    row[4], row[5], row[6] = p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2]
    row[7], row[8], row[9] = x, y, z
    if crosses or distance < _COINCIDENT:
        row[0] = -radius if crosses else distance - radius
        own_normal(d, normal, row)
    else:
        row[0] = distance - radius
        gx, gy, gz = row[4] - x, row[5] - y, row[6] - z
        size = np.sqrt(gx * gx + gy * gy + gz * gz)
        row[1], row[2], row[3] = gx / size, gy / size, gz / size
    return True
