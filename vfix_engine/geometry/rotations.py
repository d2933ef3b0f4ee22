"""Rotation vectors: axis times angle."""

from __future__ import annotations

import numpy as np

from ..arrays import Array


def rotation_vector(rotation: Array) -> Array:
    """(3,) in rad of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation  # slow to load

    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())
