"""Vectors of three floats as tuples: compiled code keeps them in registers, and plain Python can use them as well.

Sums of products start with the first term, as in ``numpy.dot`` for such short vectors.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .compiled import shared

Triple = tuple[float, float, float]


def triple(vector: NDArray[np.float64]) -> Triple:
    """Convert an array (3,)."""
    x, y, z = vector.tolist()
    return x, y, z


@shared
def dot(a: Triple, b: Triple) -> float:
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@shared
def norm(a: Triple) -> float:
    """‖a‖."""
    return math.sqrt(dot(a, a))


@shared
def cross(a: Triple, b: Triple) -> Triple:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@shared
def plus(a: Triple, b: Triple) -> Triple:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@shared
def minus(a: Triple, b: Triple) -> Triple:
    """a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@shared
def times(factor: float, a: Triple) -> Triple:
    """factor · a."""
    return factor * a[0], factor * a[1], factor * a[2]


@shared
def over(a: Triple, divisor: float) -> Triple:
    """a / divisor."""
    return a[0] / divisor, a[1] / divisor, a[2] / divisor
