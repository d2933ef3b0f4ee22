"""Smooth union and intersection of signed distances (positive outside).

The polynomial smooth minimum rounds the seam of two fields over the width k [mm]; k = 0 is the plain minimum.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Field = npt.NDArray[np.float32]


def union(a: Field, b: Field, k: float = 0.0) -> Field:
    """Return the signed distance of the union of a and b, with the seam filled over the width k."""
    if k <= 0.0:
        return np.minimum(a, b)
    overlap = np.maximum(np.float32(k) - np.abs(a - b), np.float32(0.0))
    filled: Field = np.minimum(a, b) - overlap * overlap * np.float32(0.25 / k)
    return filled


def intersection(a: Field, b: Field, k: float = 0.0) -> Field:
    """Return the signed distance of the intersection of a and b, with the edge rounded over the width k."""
    return -union(-a, -b, k)


def without(a: Field, b: Field, k: float = 0.0) -> Field:
    """Return the signed distance of a without b, with the edge rounded over the width k."""
    return intersection(a, -b, k)


def receded(cavity: Field, earlier: Field, wall: float, k: float) -> Field:
    """Return a cavity that keeps `wall` mm from all earlier ones, so that the wall between them never vanishes."""
    return without(cavity, earlier - np.float32(wall), k)
