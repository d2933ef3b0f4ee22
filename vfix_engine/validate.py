"""Validation of arguments: arrays and numbers of the right kind, or an error that names the argument.

Each function takes ``what``, the name of the argument in the message, and the class of the error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array
from .errors import InputError

FARTHEST_MM = 1e6  # a coordinate above a kilometre indicates a wrong unit; squares of much larger ones overflow
ORTHONORMAL = 1e-6  # tolerance of RᵀR − I and of the last row, absolute: at most 0.3 µm for a tool of 300 mm


def real_array(what: str, value: ArrayLike, error: type[InputError] = InputError) -> Array:
    """Return a contiguous copy of real numbers of any shape.

    Raises:
        error: text, complex numbers, rows of different lengths, or anything else that is not an array of real numbers.
    """
    try:
        given = np.asarray(value)
    except (ValueError, TypeError):  # rows of different lengths
        given = np.empty(0, dtype=object)
    if given.dtype.kind not in "iuf":
        raise error(f"{what}: {_short(value)} is no array of real numbers")
    return np.array(given, dtype=np.float64, order="C")


def point(what: str, value: ArrayLike, error: type[InputError] = InputError) -> Array:
    """Return a finite point (3,) in mm.

    Raises:
        error: anything else.
    """
    place = real_array(what, value, error)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise error(f"{what} {_short(place.tolist())} is no point x, y, z in mm")
    return place


def real(what: str, value: Any, error: type[InputError] = InputError) -> float:
    """Return a finite real number.

    Raises:
        error: anything else, including booleans.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real) or not math.isfinite(value):
        raise error(f"{what} must be a finite number, not {_short(value)}")
    return float(value)


def within(what: str, value: Any, low: float, high: float = math.inf, error: type[InputError] = InputError) -> float:
    """Return a finite real number from ``low`` to ``high``, both included.

    Raises:
        error: anything else.
    """
    number = real(what, value, error)
    if not low <= number <= high:
        raise error(f"{what} must be {_between(low, high)}, not {number:g}")
    return number


def positive(what: str, value: Any, error: type[InputError] = InputError) -> float:
    """Return a finite real number above 0.

    Raises:
        error: anything else.
    """
    number = real(what, value, error)
    if not number > 0.0:
        raise error(f"{what} must be finite and positive, not {number:g}")
    return number


def whole(what: str, value: Any, low: int, high: float = math.inf, error: type[InputError] = InputError) -> int:
    """Return an integer from ``low`` to ``high``, both included; 61.0 is accepted.

    Raises:
        error: anything else.
    """
    number = real(what, value, error)
    if number != math.floor(number) or not low <= number <= high:
        raise error(f"{what} must be a whole number {_between(low, high)}, not {_short(value)}")
    return int(number)


def several(what: str, values: Any) -> tuple[Any, ...]:
    """Return the values as a tuple.

    Raises:
        InputError: a single value, or anything else that is not a list.
    """
    if isinstance(values, (str, bytes)) or not hasattr(values, "__iter__"):
        raise InputError(f"the {what} are a list, not a {type(values).__name__}; a single one is [it]")
    return tuple(values)


def rigid_transform(transform: ArrayLike, what: str, error: type[InputError] = InputError) -> Array:
    """Return a copy of a rigid transform (4, 4), mm.

    Raises:
        error: the matrix is not rigid, or its translation exceeds FARTHEST_MM; the message begins with ``what``.
    """
    matrix = np.array(transform, dtype=np.float64, order="C")
    if matrix.shape != (4, 4) or not _is_rigid(matrix):
        if matrix.shape == (4, 4) and np.isfinite(matrix).all() and np.abs(matrix[:3, 3]).max() > FARTHEST_MM:
            raise error(f"{what} moves by more than {FARTHEST_MM:,.0f} mm; check the unit of its fourth column, mm")
        raise error(
            f"{what} is not rigid (4 x 4, orthonormal within {ORTHONORMAL:g}, right-handed); give a rotation without "
            "scale or mirror in the first three columns, a place in mm in the fourth, and 0 0 0 1 as the last row"
        )
    return matrix


def rotation_matrix(rotation: ArrayLike, what: str, error: type[InputError] = InputError) -> Array:
    """Return a copy of a rotation matrix (3, 3).

    Raises:
        error: the matrix is not a rotation; the message begins with ``what``.
    """
    matrix = real_array(what, rotation, error)
    pose = np.eye(4)
    if matrix.shape == (3, 3):
        pose[:3, :3] = matrix
    if matrix.shape != (3, 3) or not _is_rigid(pose):
        raise error(f"{what} is no rotation (3 x 3, orthonormal within {ORTHONORMAL:g}, right-handed)")
    return matrix


def _between(low: float, high: float) -> str:
    return f"from {low:,g} on" if math.isinf(high) else f"from {low:,g} to {high:,g}"


def _short(value: object) -> str:
    return f"{value!r:.60}"


def point_text(point: ArrayLike) -> str:
    """Format a point (3,) in mm."""
    x, y, z = np.asarray(point, dtype=np.float64).tolist()
    return f"({x:.1f}, {y:.1f}, {z:.1f}) in LPS mm"


def _is_rigid(matrix: Array) -> bool:
    """Check with Python floats, which are ten times as fast as NumPy here; control steps call this."""
    x, y, z, last = matrix.tolist()
    off = [_dot(a, b) - (a is b) for a, b in ((x, x), (y, y), (z, z), (x, y), (y, z), (z, x))]
    off += [*last[:3], last[3] - 1.0]
    if not all(abs(value) <= ORTHONORMAL for value in off):  # also refuses NaN
        return False
    turn = (x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0])
    return _dot(turn, z) > 0.0 and all(abs(row[3]) <= FARTHEST_MM for row in (x, y, z))


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
