"""Checks of arguments: points and the range of coordinates; mm."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import InputError
from ..validate import FARTHEST_MM


def out_of_range(points: Array) -> tuple[int, str] | None:
    """Index of the first of finite points (n, 3) with a coordinate above ``FARTHEST_MM``, and its description."""
    far = np.flatnonzero((np.abs(points) > FARTHEST_MM).any(axis=1))
    if not len(far):
        return None
    x, y, z = points[far[0]].tolist()
    return int(far[0]), (
        f"lies at ({x:.6g}, {y:.6g}, {z:.6g}) mm, a coordinate of more than {FARTHEST_MM:g} mm; check its unit"
    )


def checked_points(points: ArrayLike) -> NDArray[np.float64]:
    """Convert points (n, 3) to float64.

    Raises:
        InputError: points are not finite or not of that shape.
    """
    places = np.array(points, dtype=np.float64, order="C")
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        raise InputError(f"points must be finite and of the shape (n, 3), not {places.shape}")
    return places
