"""Conversion between vfix and the scene of 3D Slicer: the image is LPS here and RAS there; other frames are the same.

With F = diag(-1, -1, 1, 1), a position p of the image becomes F p. A pose T of an object in the image, such as the
tool, becomes F T. A registration T, which maps the image to the patient (a tracker's frame, or the robot's base),
becomes T F.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from app.link import LinkFault
from vfix_engine.arrays import Array
from vfix_engine.frames import RAS_TO_LPS

_FLIP: Array = np.diag([*RAS_TO_LPS, 1.0])
# Rounding errors of float32 in a coordinate of 1 m and in a component of a rotation, for a few operations.
SAME_MM, SAME_ROTATION = 2e-4, 2e-6
_RIGID = 1e-4  # bound of RᵀR − I for a matrix in float32


def to_ras(position: Iterable[float]) -> tuple[float, float, float]:
    """Convert a position of the image to Slicer's scene, or back."""
    x, y, z = position
    return (-x + 0.0, -y + 0.0, z + 0.0)


def pose_to_ras(transform: Array) -> Array:
    """Convert a pose (4, 4) in the image to Slicer's scene."""
    return _FLIP @ transform


def registration_to_ras(transform: Array) -> Array:
    """Convert a registration (4, 4) to one from Slicer's scene to the patient, or back."""
    return transform @ _FLIP


def as_in_a_file(transform: Array) -> Array:
    """Return the registration (4, 4) that results if Slicer's matrix of the `.tfm` file of ``transform`` is sent back.

    Slicer assumes that both frames of a file are LPS, and shows F T F.
    """
    return _FLIP @ transform


def rigid(matrix: Array) -> Array:
    """Return the rigid transform (4, 4) nearest to a matrix rounded to float32. Raises LinkFault if it is not rigid."""
    rotation = matrix[:3, :3]
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > _RIGID or np.linalg.det(rotation) < 0:
        raise LinkFault("the matrix is not rigid: it scales, shears or mirrors.")
    u, _, vt = np.linalg.svd(rotation)
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = u @ vt, matrix[:3, 3]
    return found


def same_transform(one: Array, other: Array) -> bool:
    """Return whether two transforms (4, 4) differ by no more than the rounding of float32."""
    turned, moved = np.abs(one[:3, :3] - other[:3, :3]).max(), np.abs(one[:3, 3] - other[:3, 3]).max()
    return bool(turned <= SAME_ROTATION and moved <= SAME_MM)
