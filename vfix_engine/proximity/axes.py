"""Rotations that are given by one axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array


def rotation_z_to(direction: ArrayLike) -> Array:
    """Rotation (3, 3) that takes +z to a direction (3,) of any length but 0; the turn about it is left open."""
    z = np.asarray(direction, dtype=np.float64)
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)
