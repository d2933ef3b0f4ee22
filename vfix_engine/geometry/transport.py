"""Rotation-minimising frames along a curve.

Double reflection: W. Wang, B. Jüttler, D. Zheng and Y. Liu, "Computation of rotation minimizing frames", ACM
Transactions on Graphics 27(1), 2008, section 4.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..kernels.compiled import compiled


def transported(centre: ArrayLike, tangent: ArrayLike, start: ArrayLike | None = None) -> Array:
    """Unit vectors (C, 3), each perpendicular to its tangent, parallel transported along the curve.

    Args:
        centre: (C, 3) mm; neighbours are distinct.
        tangent: (C, 3) unit; none is opposite to the previous one.
        start: (3,) direction whose projection is the first vector; None, or parallel to the first tangent: arbitrary.
    """
    places, along = np.array(centre, dtype=np.float64, order="C"), np.array(tangent, dtype=np.float64, order="C")
    first = across(along[0], start)
    frames = np.empty_like(places)
    double_reflection(places, along, first, frames)
    return frames


def across(tangent: Array, start: ArrayLike | None = None) -> Array:
    """Unit vector (3,) perpendicular to a unit tangent (3,), nearest to ``start``, or arbitrary without one."""
    if start is not None:
        wanted = np.asarray(start, dtype=np.float64)
        found: Array = wanted - (wanted @ tangent) * tangent
        size = float(np.linalg.norm(found))
        if size > 1e-9 * float(np.linalg.norm(wanted)):
            return found / size
    least = np.zeros(3)
    least[int(np.abs(tangent).argmin())] = 1.0
    found = least - (least @ tangent) * tangent
    return found / float(np.linalg.norm(found))


@compiled
def double_reflection(centre: Array, tangent: Array, start: Array, out: Array) -> None:
    """Fill ``out`` (C, 3) from the first vector (3,); Wang 2008, table I."""
    rx, ry, rz = start[0], start[1], start[2]
    out[0, 0], out[0, 1], out[0, 2] = rx, ry, rz
    for i in range(len(centre) - 1):
        # Reflect vector and tangent in the bisecting plane of the two centres ...
        vx, vy, vz = centre[i + 1, 0] - centre[i, 0], centre[i + 1, 1] - centre[i, 1], centre[i + 1, 2] - centre[i, 2]
        c = 2.0 / (vx * vx + vy * vy + vz * vz)
        tx, ty, tz = tangent[i, 0], tangent[i, 1], tangent[i, 2]
        f = c * (vx * rx + vy * ry + vz * rz)
        rx, ry, rz = rx - f * vx, ry - f * vy, rz - f * vz
        f = c * (vx * tx + vy * ty + vz * tz)
        tx, ty, tz = tx - f * vx, ty - f * vy, tz - f * vz
        # ... and then in the plane that maps the reflected tangent to the next.
        nx, ny, nz = tangent[i + 1, 0], tangent[i + 1, 1], tangent[i + 1, 2]
        vx, vy, vz = nx - tx, ny - ty, nz - tz
        size = vx * vx + vy * vy + vz * vz
        if size > 0.0:
            f = 2.0 / size * (vx * rx + vy * ry + vz * rz)
            rx, ry, rz = rx - f * vx, ry - f * vy, rz - f * vz
        # Project and normalise, so that rounding does not accumulate over thousands of steps.
        f = rx * nx + ry * ny + rz * nz
        rx, ry, rz = rx - f * nx, ry - f * ny, rz - f * nz
        f = 1.0 / math.sqrt(rx * rx + ry * ry + rz * rz)
        rx, ry, rz = f * rx, f * ry, f * rz
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2] = rx, ry, rz
