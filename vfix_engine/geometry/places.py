"""What may enter as a place or as a frame, in mm: the bound on coordinates, and the one check of rigid transforms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]

FARTHEST_MM = 1e6  # a place a kilometre away is an error of units; squares of much larger numbers overflow
ORTHONORMAL = 1e-6  # of RᵀR − I and of the last row, absolute: a tool of 300 mm is then off by 0.3 µm at most


def too_far(points: Array) -> tuple[int, str] | None:
    """Index of the first of finite points (n, 3) that no patient or tool can be at, and the reason as a sentence."""
    far = np.flatnonzero((np.abs(points) > FARTHEST_MM).any(axis=1))
    if not len(far):
        return None
    x, y, z = points[far[0]].tolist()
    return int(far[0]), (
        f"lies at ({x:.6g}, {y:.6g}, {z:.6g}) mm, a coordinate of more than {FARTHEST_MM:g} mm; check its unit"
    )


def rigid_transform(transform: ArrayLike, what: str, error: type[InputError] = InputError) -> Array:
    """A copy of a rigid transform (4, 4); ``error``, beginning with ``what``, where it is none."""
    matrix = np.array(transform, dtype=np.float64, order="C")
    if matrix.shape != (4, 4) or not _is_rigid(matrix):
        raise error(f"{what} is not rigid (4 x 4, orthonormal within {ORTHONORMAL:g}, right-handed)")
    return matrix


def _is_rigid(matrix: Array) -> bool:
    """In plain numbers, as a step of control asks for it: NumPy takes ten times as long for so few."""
    x, y, z, last = matrix.tolist()
    off = [_dot(a, b) - (a is b) for a, b in ((x, x), (y, y), (z, z), (x, y), (y, z), (z, x))]
    off += [*last[:3], last[3] - 1.0]
    if not all(abs(value) <= ORTHONORMAL for value in off):  # NaN is refused as well
        return False
    turn = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])
    return _dot(turn, z) > 0.0 and all(abs(row[3]) <= FARTHEST_MM for row in (x, y, z))


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
