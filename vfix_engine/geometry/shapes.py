"""Solid shapes of zones: sphere, capsule, box, half-space; patient frame, mm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import InputError
from ..validate import rigid_transform

__all__ = ["Box", "CapsuleShape", "HalfSpace", "Shape", "ShapeTable", "Sphere", "shape_table"]


SPHERE, CAPSULE, BOX, HALF_SPACE = range(4)
DATA_WIDTH = 16
_FAR_MM = 1e5  # 100 m: no patient is beyond it, and squares lose precision


@dataclass(frozen=True, eq=False)
class Sphere:
    """All points within ``radius`` mm of ``centre`` (3,).

    Raises:
        InputError: a number is not finite or too large, or the radius is not positive.
    """

    centre: Array
    radius: float

    def __init__(self, centre: ArrayLike, radius: float) -> None:
        object.__setattr__(self, "centre", _vector("a sphere's centre", centre))
        object.__setattr__(self, "radius", _length("a sphere's radius", radius))


@dataclass(frozen=True, eq=False)
class CapsuleShape:
    """All points within ``radius`` mm of the segment from ``start`` (3,) to ``end`` (3,), which may be one point.

    Raises:
        InputError: a number is not finite or too large, or the radius is not positive.
    """

    start: Array
    end: Array
    radius: float

    def __init__(self, start: ArrayLike, end: ArrayLike, radius: float) -> None:
        object.__setattr__(self, "start", _vector("a capsule's start", start))
        object.__setattr__(self, "end", _vector("a capsule's end", end))
        object.__setattr__(self, "radius", _length("a capsule's radius", radius))


@dataclass(frozen=True, eq=False)
class Box:
    """A box around the origin of its own frame, −half_size … half_size (3,) mm along its axes.

    Args:
        transform_box_to_patient: (4, 4) rigid, mm.
        half_size: (3,) mm, each positive.

    Raises:
        InputError: the transform is not rigid, or a half size is not positive.
    """

    transform_box_to_patient: Array
    half_size: Array

    def __init__(self, transform_box_to_patient: ArrayLike, half_size: ArrayLike) -> None:
        object.__setattr__(self, "transform_box_to_patient", _rigid(transform_box_to_patient))
        size = _vector("a box's half sizes", half_size)
        if (size <= 0.0).any():
            raise InputError(f"a box's half sizes must be positive, not {', '.join(f'{v:g}' for v in size)} mm")
        object.__setattr__(self, "half_size", size)


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """All points behind the plane through ``point`` (3,); ``normal`` (3,) points to the free side.

    Raises:
        InputError: a number is not finite or too large, or the normal has no direction.
    """

    point: Array
    normal: Array

    def __init__(self, point: ArrayLike, normal: ArrayLike) -> None:
        direction = _vector("a half-space's normal", normal)
        length = float(np.linalg.norm(direction))
        if length < 1e-9:
            raise InputError("a half-space's normal has no direction: its length is 0")
        unit = direction / length
        unit.setflags(write=False)
        object.__setattr__(self, "point", _vector("a half-space's point", point))
        object.__setattr__(self, "normal", unit)


Shape = Sphere | CapsuleShape | Box | HalfSpace


class ShapeTable(NamedTuple):
    """Shapes in the layout of the compiled kernels.

    kind: (z,) SPHERE, CAPSULE, BOX or HALF_SPACE.
    data: (z, 16) mm, unused entries 0. Sphere: centre 3, radius. Capsule: start 3, end − start 3, radius.
    Box: centre 3, rotation_box_to_patient 9 row by row, half sizes 3. Half-space: unit normal 3, normal · point.
    """

    kind: NDArray[np.int64]
    data: Array


def shape_table(shapes: Sequence[Shape]) -> ShapeTable:
    """Pack a sequence of shapes, in its order; read-only.

    Raises:
        InputError: an element of the sequence is not a shape.
    """
    kind, data = np.zeros(len(shapes), np.int64), np.zeros((len(shapes), DATA_WIDTH))
    for i, shape in enumerate(shapes):
        kind[i], numbers = _numbers(shape)
        data[i, : len(numbers)] = numbers
    kind.setflags(write=False)
    data.setflags(write=False)
    return ShapeTable(kind, data)


def _numbers(shape: Shape) -> tuple[int, Array]:
    if isinstance(shape, Sphere):
        return SPHERE, np.append(shape.centre, shape.radius)
    if isinstance(shape, CapsuleShape):
        return CAPSULE, np.concatenate([shape.start, shape.end - shape.start, [shape.radius]])
    if isinstance(shape, Box):
        transform = shape.transform_box_to_patient
        return BOX, np.concatenate([transform[:3, 3], transform[:3, :3].ravel(), shape.half_size])
    if isinstance(shape, HalfSpace):
        return HALF_SPACE, np.append(shape.normal, shape.normal @ shape.point)
    raise InputError(f"a shape is a Sphere, CapsuleShape, Box or HalfSpace, not {type(shape).__name__}")


def _numeric(words: str, value: ArrayLike) -> Array:
    """Copy as float64; InputError with ``words`` for anything that is not numeric, including text."""
    try:
        array = np.array(value)
    except (TypeError, ValueError) as error:
        raise InputError(words) from error
    if array.dtype.kind not in "iuf":
        raise InputError(words)
    return array.astype(np.float64)


def _vector(what: str, value: ArrayLike) -> Array:
    """Return a read-only copy (3,) of finite numbers within ``_FAR_MM``."""
    vector = _numeric(f"{what} must be three numbers in mm", value)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{what} must be three finite numbers in mm, not {vector.tolist()}")
    if np.abs(vector).max() > _FAR_MM:
        raise InputError(f"{what} is {np.abs(vector).max():g}; more than {_FAR_MM:g} mm from the origin is no patient")
    vector.setflags(write=False)
    return vector


def _length(what: str, value: float) -> float:
    number = _numeric(f"{what} must be a number of mm", value)
    if number.shape != ():
        raise InputError(f"{what} must be one number of mm")
    length = float(number)
    if not 0.0 < length <= _FAR_MM:  # NaN fails as well
        raise InputError(f"{what} is {length:g} mm; it must be positive, {_FAR_MM:g} mm at most")
    return length


def _rigid(transform: ArrayLike) -> Array:
    matrix = _numeric("a box needs a rigid transform of 4 x 4 numbers", transform)
    matrix = rigid_transform(matrix, "a box's transform")
    # The nearest rotation: an orthonormality error of 1e-6 would become an error of the distance.
    left, _, right = np.linalg.svd(matrix[:3, :3])
    matrix[:3, :3] = left @ right
    _vector("a box's centre", matrix[:3, 3])
    matrix.setflags(write=False)
    return matrix
