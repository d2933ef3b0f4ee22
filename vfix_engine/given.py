"""Numbers that come from outside, as arrays and numbers of the right kind, or an error that says what they are."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError

Array = NDArray[np.float64]


def real_array(what: str, value: ArrayLike, error: type[InputError] = InputError) -> Array:
    """A contiguous copy of real numbers, whatever their shape.

    Raises:
        error: words, complex numbers, rows of different lengths or anything else that is no array of real numbers.
    """
    try:
        given = np.asarray(value)
    except (ValueError, TypeError):  # rows of different lengths
        given = np.empty(0, dtype=object)
    if given.dtype.kind not in "iuf":
        raise error(f"{what}: {_short(value)} is no array of real numbers")
    return np.array(given, dtype=np.float64, order="C")


def point(what: str, value: ArrayLike, error: type[InputError] = InputError) -> Array:
    """A place (3,) in mm.

    Raises:
        error: anything else.
    """
    place = real_array(what, value, error)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise error(f"{what} {_short(place.tolist())} is no point x, y, z in mm")
    return place


def real(what: str, value: Any, error: type[InputError] = InputError) -> float:
    """A finite real number.

    Raises:
        error: anything else, also true and false.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real) or not math.isfinite(value):
        raise error(f"{what} must be a finite number, not {_short(value)}")
    return float(value)


def within(what: str, value: Any, low: float, high: float = math.inf, error: type[InputError] = InputError) -> float:
    """A finite real number from ``low`` to ``high``, both included.

    Raises:
        error: anything else.
    """
    number = real(what, value, error)
    if not low <= number <= high:
        raise error(f"{what} must be {_between(low, high)}, not {number:g}")
    return number


def positive(what: str, value: Any, error: type[InputError] = InputError) -> float:
    """A finite real number above 0.

    Raises:
        error: anything else.
    """
    number = real(what, value, error)
    if not number > 0.0:
        raise error(f"{what} must be finite and positive, not {number:g}")
    return number


def whole(what: str, value: Any, low: int, high: float = math.inf, error: type[InputError] = InputError) -> int:
    """A whole number from ``low`` to ``high``, both included; 61.0 is one.

    Raises:
        error: anything else.
    """
    number = real(what, value, error)
    if number != math.floor(number) or not low <= number <= high:
        raise error(f"{what} must be a whole number {_between(low, high)}, not {_short(value)}")
    return int(number)


def _between(low: float, high: float) -> str:
    return f"from {low:,g} on" if math.isinf(high) else f"from {low:,g} to {high:,g}"


def _short(value: object) -> str:
    return f"{value!r:.60}"


def place_words(point: ArrayLike) -> str:
    """Where a point (3,) is, for people."""
    x, y, z = np.asarray(point, dtype=np.float64).tolist()
    return f"({x:.1f}, {y:.1f}, {z:.1f}) in LPS mm"
