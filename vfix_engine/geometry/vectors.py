"""Norm and cross products of single vectors: bitwise equal to NumPy's, and several times faster for one vector."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array


def length(vector: Array) -> float:
    """‖v‖ of a contiguous vector (n,), as ``np.linalg.norm``."""
    return math.sqrt(vector.dot(vector))


def cross(a: Array, b: Array) -> Array:
    """a × b (3,) of two vectors (3,), as ``np.cross``."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def cross_columns(a: Array, columns: Array) -> Array:
    """a × b for every column b of (3, n): (3, n), as ``np.cross(a, columns.T).T``."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), columns
    product = np.empty(columns.shape)
    product[0] = ay * bz - az * by
    product[1] = az * bx - ax * bz
    product[2] = ax * by - ay * bx
    return product
