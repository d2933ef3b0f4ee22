"""Points that callers hand in."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError


def checked_points(points: ArrayLike) -> NDArray[np.float64]:
    """Points (n, 3) as float64.

    Raises:
        InputError: points that are not finite or not of that shape.
    """
    places = np.array(points, dtype=np.float64, order="C")
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        raise InputError(f"points must be finite and of the shape (n, 3), not {places.shape}")
    return places
