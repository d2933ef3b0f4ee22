"""Compiled distances to capsules that stand in many poses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..kernels.compiled import compiled

_TINY = 1e-12  # mm², added to the squared length of an axis: one without length is a ball
_PIECE = 4  # voxels: a long axis is walked in pieces, so that only voxels near it are visited


@compiled
def lower_field(field: Any, start: Any, end: Any, radius: Any, low: Any, voxel: float, band: float) -> None:
    """Lower a field (X, Y, Z) to the distance of its voxels to capsules, where that is less than ``band`` mm.

    start, end: (n, 3) mm; radius: (n,) mm; low: (3,) mm, the first voxel; voxel: mm between two.
    """
    for c in range(len(start)):
        ax, ay, az, r = start[c, 0], start[c, 1], start[c, 2], radius[c]
        dx, dy, dz = end[c, 0] - ax, end[c, 1] - ay, end[c, 2] - az
        squared = dx * dx + dy * dy + dz * dz + _TINY
        pieces = int(math.sqrt(squared) / (_PIECE * voxel)) + 1
        first, last = np.empty(3, np.int64), np.empty(3, np.int64)
        for piece in range(pieces):
            u, v = piece / pieces, (piece + 1) / pieces
            for axis in range(3):
                p = start[c, axis] + u * (end[c, axis] - start[c, axis])
                q = start[c, axis] + v * (end[c, axis] - start[c, axis])
                first[axis] = max(0, int((min(p, q) - r - band - low[axis]) / voxel))
                last[axis] = min(field.shape[axis] - 1, int((max(p, q) + r + band - low[axis]) / voxel) + 1)
            for i in range(first[0], last[0] + 1):
                x = low[0] + i * voxel - ax
                for j in range(first[1], last[1] + 1):
                    y = low[1] + j * voxel - ay
                    for k in range(first[2], last[2] + 1):
                        z = low[2] + k * voxel - az
                        t = min(1.0, max(0.0, (x * dx + y * dy + z * dz) / squared))
                        ex, ey, ez = x - t * dx, y - t * dy, z - t * dz
                        found = math.sqrt(ex * ex + ey * ey + ez * ez) - r
                        if found < field[i, j, k]:
                            field[i, j, k] = found


@compiled
def lower_least(least: Any, points: Any, start: Any, end: Any, radius: Any) -> None:
    """Lower distances (m,) of points (m, 3) to that to capsules; what is further than ``least`` of all is not measured.

    start, end: (n, 3) mm; radius: (n,) mm.
    """
    reach = 0.0
    for i in range(len(least)):
        reach = max(reach, least[i])
    for c in range(len(start)):
        ax, ay, az, r = start[c, 0], start[c, 1], start[c, 2], radius[c]
        dx, dy, dz = end[c, 0] - ax, end[c, 1] - ay, end[c, 2] - az
        squared, m = dx * dx + dy * dy + dz * dz + _TINY, reach + r
        lx, hx = min(0.0, dx) - m, max(0.0, dx) + m
        ly, hy = min(0.0, dy) - m, max(0.0, dy) + m
        lz, hz = min(0.0, dz) - m, max(0.0, dz) + m
        for i in range(len(points)):
            x, y, z = points[i, 0] - ax, points[i, 1] - ay, points[i, 2] - az
            if x < lx or x > hx or y < ly or y > hy or z < lz or z > hz:
                continue
            t = min(1.0, max(0.0, (x * dx + y * dy + z * dz) / squared))
            ex, ey, ez = x - t * dx, y - t * dy, z - t * dz
            found = math.sqrt(ex * ex + ey * ey + ez * ez) - r
            if found < least[i]:
                least[i] = found
