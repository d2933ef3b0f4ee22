"""Signed distance of points from solid shapes: negative inside, mm."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from .shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere


def signed_distance(shape: Shape, points: ArrayLike) -> Array:
    """Signed distance (n,) of points (n, 3), patient frame, from the surface of a shape; inside it is minus the depth.

    Raises:
        InputError: points have another shape, or ``shape`` is not a solid shape.
    """
    places = np.asarray(points, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3:
        raise InputError(f"points must be (n, 3), not {places.shape}")
    if isinstance(shape, Sphere):
        return np.asarray(np.linalg.norm(places - shape.centre, axis=1) - shape.radius)
    if isinstance(shape, CapsuleShape):
        return _from_segment(places, shape.start, shape.end) - shape.radius
    if isinstance(shape, Box):
        return _from_box(places, shape)
    if isinstance(shape, HalfSpace):
        depth: Array = (places - shape.point) @ shape.normal
        return depth
    raise InputError(f"a {type(shape).__name__} is no solid shape")


def _from_segment(places: Array, start: Array, end: Array) -> Array:
    along = end - start
    square = float(along @ along)
    share = np.zeros(len(places)) if square == 0.0 else np.clip((places - start) @ along / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(places - start - share[:, None] * along, axis=1))


def _from_box(places: Array, box: Box) -> Array:
    to_patient = box.transform_box_to_patient
    beyond = np.abs((places - to_patient[:3, 3]) @ to_patient[:3, :3]) - box.half_size
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0))
