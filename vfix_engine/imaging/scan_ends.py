"""Flat faces that close a surface where its scan ends: they are no anatomy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.volume import Volume

_FLAT_COSINE = 0.9  # between a face's normal and the axis of the volume that ends there
_HOLDS_VOXELS = 1.0  # that a surface may reach beyond the centres of the last voxels of its volume


def source_of(mesh: TriangleMesh, volumes: Sequence[Volume]) -> Volume | None:
    """The finest of the volumes that hold a whole surface, which it was made of; None where none holds it."""
    fitting = [volume for volume in volumes if _holds(volume, mesh)]
    return min(fitting, key=lambda volume: float(np.prod(volume.spacing)), default=None)


def _holds(volume: Volume, mesh: TriangleMesh) -> bool:
    index = volume.lps_to_index(mesh.vertices)
    return bool((index >= -_HOLDS_VOXELS).all() and (index <= _last(volume) + _HOLDS_VOXELS).all())


def faces_at_ends(mesh: TriangleMesh, volume: Volume) -> npt.NDArray[np.bool_]:
    """Which faces (F,) lie flat within the last voxel of a volume, along its own axes, however these are turned.

    Grey values put the border of what is closed by padding anywhere within that voxel.
    """
    index, last = volume.lps_to_index(mesh.vertices), _last(volume)
    normals = mesh.face_normals
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    along = np.abs(np.divide(normals, size, out=np.zeros_like(normals), where=size > 0.0) @ volume.direction)
    found = np.zeros(len(mesh.faces), dtype=np.bool_)
    for axis in range(3):
        flat = along[:, axis] > _FLAT_COSINE
        for beyond in (index[:, axis], last[axis] - index[:, axis]):
            found |= flat & (beyond <= 1.0)[mesh.faces].all(axis=1)
    return found


def _last(volume: Volume) -> npt.NDArray[np.float64]:
    """(3,) index of the last voxel along i, j, k."""
    return np.array(volume.hu.shape[::-1], dtype=np.float64) - 1.0
