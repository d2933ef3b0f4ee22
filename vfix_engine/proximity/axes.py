"""Rotations determined by one axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array


def rotation_z_to(direction: ArrayLike) -> Array:
    """Return a rotation (3, 3) that maps +z to a direction (3,) of any nonzero length; its roll is arbitrary."""
    z = np.asarray(direction, dtype=np.float64)
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)
