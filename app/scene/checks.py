"""What a browser says about the scene is checked before anything is made of it (HAZ-05)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

MAX_MM = 1e4  # no head, and no camera that sees one, is so far away

Floats = npt.NDArray[np.float64]


def finite_position(values: Any) -> Floats | None:
    """A place (3,) in LPS mm within ±MAX_MM; None for anything else."""
    found = finite_numbers(values, 3)
    return found if found is not None and np.abs(found).max() <= MAX_MM else None


def finite_numbers(values: Any, count: int) -> Floats | None:
    """That many finite numbers (count,); None for anything else."""
    try:
        found = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    return found if found.shape == (count,) and np.isfinite(found).all() else None
