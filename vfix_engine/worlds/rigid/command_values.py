"""Validation of numbers from a script or a hand: arrays and fractions, or an InputError (HAZ-05)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError


def array_of(values: ArrayLike, name: str) -> Array:
    """A float array of any shape, finite or not. Text and integers beyond the range of floats are refused."""
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biufO":
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise InputError(f"{name} is not made of numbers")


def finite_array(values: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """Finite numbers of that shape, −1 for any length."""
    array = array_of(values, name)
    if array.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, array.shape, strict=True)):
        wanted = " x ".join("n" if size < 0 else str(size) for size in shape)
        raise InputError(f"{name} has the shape {array.shape}, not {wanted}")
    if not np.isfinite(array).all():
        raise InputError(f"{name} has a value that is not finite")
    return array


def share_of(value: Any, name: str) -> float:
    """A fraction of full force, clamped to -1 … 1; a non-finite one is 0."""
    if (type(value) is float or type(value) is int) and -1 <= value <= 1:
        return float(value)
    if isinstance(value, (int, float)):
        return float(min(max(value, -1), 1)) if abs(value) < math.inf else 0.0
    if isinstance(value, np.number) and np.isrealobj(value):
        return share_of(float(value), name)
    raise InputError(f"the {name} is not a number from -1 to 1")
