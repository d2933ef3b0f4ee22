"""Segments of a pathway that intersect given arcs, compiled: called several times per step of the drive."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..kernels.compiled import no_refcount


@no_refcount
def put_windows(s: Array, low: Array, high: Array, before: int, segments: int, out: NDArray[np.int64]) -> int:
    """Write windows of arcs low (n,) … high (n,) mm into ``out`` (n, 2); return the first invalid arc, or -1.

    s: (C,) arc lengths of the contours, increasing; before: segments ahead of the first contour; segments: total.
    """
    for k in range(len(low)):
        if not (low[k] <= high[k] and math.isfinite(low[k]) and math.isfinite(high[k])):
            return k
        a, b = 0, len(s)
        while a < b:  # count the contours up to low
            middle = (a + b) // 2
            if s[middle] <= low[k]:
                a = middle + 1
            else:
                b = middle
        first = min(max(a - 2 + before, 0), segments - 1)
        a, b = 0, len(s)
        while a < b:  # and those before high
            middle = (a + b) // 2
            if s[middle] < high[k]:
                a = middle + 1
            else:
                b = middle
        out[k, 0], out[k, 1] = first, max(min(a + before + 1, segments), first + 1)
    return -1
