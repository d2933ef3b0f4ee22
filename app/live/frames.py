"""Between vfix and the scene of 3D Slicer: the image is LPS here and RAS there; no other frame is turned.

With F = diag(-1, -1, 1, 1): a place p of the image is F p. A pose of something in the image, such as the tool's, is
F T. A registration, which takes the image to the patient's own frame (a tracker's, or the robot's base), is T F.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from app.link import LinkFault
from vfix_engine.arrays import Array
from vfix_engine.frames import RAS_TO_LPS

_FLIP: Array = np.diag([*RAS_TO_LPS, 1.0])
# What float32 may change of a coordinate of 1 m, and of a component of a rotation, with room for a few operations.
SAME_MM, SAME_ROTATION = 2e-4, 2e-6
_RIGID = 1e-4  # of RᵀR − I, of a matrix in float32


def to_ras(position: Iterable[float]) -> tuple[float, float, float]:
    """A place of the image in Slicer's scene, or back."""
    x, y, z = position
    return (-x + 0.0, -y + 0.0, z + 0.0)


def pose_to_ras(transform: Array) -> Array:
    """A pose in the image (4, 4) as one in Slicer's scene."""
    return _FLIP @ transform


def registration_to_ras(transform: Array) -> Array:
    """A registration (4, 4) as one that takes Slicer's scene to the patient, or back."""
    return transform @ _FLIP


def as_in_a_file(transform: Array) -> Array:
    """A registration (4, 4) that would be told by the matrix that 3D Slicer shows of the `.tfm` file of ``transform``.

    Slicer takes both frames of a file for LPS, and shows F T F.
    """
    return _FLIP @ transform


def rigid(matrix: Array) -> Array:
    """The rigid transform (4, 4) next to a matrix that float32 has rounded. Raises LinkFault where it is not rigid."""
    rotation = matrix[:3, :3]
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > _RIGID or np.linalg.det(rotation) < 0:
        raise LinkFault("the matrix is not rigid: it scales, shears or mirrors.")
    u, _, vt = np.linalg.svd(rotation)
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = u @ vt, matrix[:3, 3]
    return found


def same_transform(one: Array, other: Array) -> bool:
    """Whether two transforms (4, 4) differ by no more than float32 rounds."""
    turned, moved = np.abs(one[:3, :3] - other[:3, :3]).max(), np.abs(one[:3, 3] - other[:3, 3]).max()
    return bool(turned <= SAME_ROTATION and moved <= SAME_MM)
