"""Checks of values that a browser reports about the scene (HAZ-05)."""

from __future__ import annotations

from typing import Any

import numpy as np

from vfix_engine.arrays import Array

MAX_MM = 1e4  # beyond any head and any camera that sees one


def finite_position(values: Any) -> Array | None:
    """Return a position (3,) in LPS mm within ±MAX_MM; None for anything else."""
    return finite_numbers(values, 3, MAX_MM)


def finite_numbers(values: Any, count: int, at_most: float = np.inf) -> Array | None:
    """Return finite numbers (count,) within ±at_most; None for anything else."""
    try:
        found = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    usable = found.shape == (count,) and np.isfinite(found).all() and np.abs(found).max(initial=0.0) <= at_most
    return found if usable else None
