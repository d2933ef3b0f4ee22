"""Flat faces that close a surface where its scan ends, and are not anatomy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

_FLAT_COSINE = 0.9  # between a face's normal and the axis of the volume that ends there
_HOLDS_VOXELS = 1.0  # tolerance of a surface beyond the centres of the last voxels of its volume


def source_of(mesh: TriangleMesh, volumes: Sequence[Volume]) -> Volume | None:
    """Return the finest of the volumes that contain the whole surface, its presumed source; None if there is none."""
    fitting = [volume for volume in volumes if _holds(volume, mesh)]
    return min(fitting, key=lambda volume: float(np.prod(volume.spacing)), default=None)


def _holds(volume: Volume, mesh: TriangleMesh) -> bool:
    index = volume.lps_to_index(mesh.vertices)
    return bool((index >= -_HOLDS_VOXELS).all() and (index <= _last(volume) + _HOLDS_VOXELS).all())


def faces_at_ends(mesh: TriangleMesh, volume: Volume) -> npt.NDArray[np.bool_]:
    """Mask (F,) of the faces that lie flat within the last voxel of a volume, along its own axes in any orientation.

    Depending on the grey values, the border that padding creates lies anywhere within that voxel.
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
