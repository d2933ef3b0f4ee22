"""Interpolation in a distance grid, inlined into kernels that evaluate many points."""

from __future__ import annotations

import math
from typing import Any

from ..kernels.compiled import inlined


@inlined
def grid_value(values: Any, origin: Any, step: float, x: float, y: float, z: float) -> float:
    """Trilinear value of a grid (K, J, I) at a position in mm; NaN outside the grid."""
    top_k, top_j, top_i = values.shape[0] - 1, values.shape[1] - 1, values.shape[2] - 1
    a, b, c = (x - origin[0]) / step, (y - origin[1]) / step, (z - origin[2]) / step
    if not (0.0 <= a <= top_i and 0.0 <= b <= top_j and 0.0 <= c <= top_k):
        return math.nan
    i, j, k = min(int(a), top_i - 1), min(int(b), top_j - 1), min(int(c), top_k - 1)
    a, b, c = a - i, b - j, c - k
    low = (values[k, j, i] * (1.0 - a) + values[k, j, i + 1] * a) * (1.0 - b)
    low += (values[k, j + 1, i] * (1.0 - a) + values[k, j + 1, i + 1] * a) * b
    high = (values[k + 1, j, i] * (1.0 - a) + values[k + 1, j, i + 1] * a) * (1.0 - b)
    high += (values[k + 1, j + 1, i] * (1.0 - a) + values[k + 1, j + 1, i + 1] * a) * b
    value: float = low * (1.0 - c) + high * c
    return value
