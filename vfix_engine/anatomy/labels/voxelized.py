"""Voxels inside a closed surface, by the parity of the crossings of a line along k; LPS mm."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError
from vfix_engine.geometry.mesh import TriangleMesh

# Surfaces of masks have vertices on the lines between voxel centres; a line offset from the centre meets none of them.
_BESIDE = (1.3e-5, 2.9e-5)  # [voxel] along i and j
_CHUNK = 200_000  # triangles
_LARGEST = 4_000_000  # columns per chunk


def voxels_inside(
    mesh: TriangleMesh, transform_index_to_lps: npt.ArrayLike, shape: tuple[int, int, int]
) -> npt.NDArray[np.bool_]:
    """Mask (K, J, I) of the voxels whose centre lies inside a closed surface; shape: (K, J, I) of the grid.

    transform_index_to_lps: (4, 4) affine from (i, j, k) to LPS mm. Raises ImageError for an open surface.
    """
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(edges[:, 0].astype(np.int64) * len(mesh.vertices) + edges[:, 1], return_counts=True)
    if (uses % 2).any():
        raise ImageError("the surface is open; only a closed one has an inside.")
    inverse = np.linalg.inv(np.asarray(transform_index_to_lps, dtype=np.float64))
    index = mesh.vertices @ inverse[:3, :3].T + inverse[:3, 3]
    index[:, :2] -= _BESIDE
    crossings = np.zeros((shape[0] + 1, shape[1], shape[2]), dtype=bool)
    for start in range(0, len(mesh.faces), _CHUNK):
        _cross(crossings, index[mesh.faces[start : start + _CHUNK]])
    inside: npt.NDArray[np.bool_] = np.logical_xor.accumulate(crossings, axis=0)[:-1]
    return inside


def _cross(crossings: npt.NDArray[np.bool_], corners: Array) -> None:
    """Flip the first voxel above each crossing of a line with triangles (n, 3, 3), given in voxels."""
    counts = np.array(crossings.shape[:0:-1])  # voxels along i and j
    low = np.clip(np.ceil(corners[:, :, :2].min(axis=1)), 0, counts).astype(np.int64)
    high = np.clip(np.floor(corners[:, :, :2].max(axis=1)) + 1, 0, counts).astype(np.int64)
    wide = np.maximum(high - low, 0)
    columns = wide.prod(axis=1)
    if columns.sum() > _LARGEST and len(corners) > 1:
        half = len(corners) // 2
        _cross(crossings, corners[:half])
        _cross(crossings, corners[half:])
        return
    own = np.repeat(np.arange(len(corners)), columns)
    nth = np.arange(len(own)) - np.repeat(np.cumsum(columns) - columns, columns)
    i = low[own, 0] + nth % np.maximum(wide[own, 0], 1)
    j = low[own, 1] + nth // np.maximum(wide[own, 0], 1)
    place = np.stack([i, j], axis=1).astype(np.float64)
    a, b, c = (corners[own, n] for n in range(3))
    areas = [_area(b, c, place), _area(c, a, place), _area(a, b, place)]
    inside = np.all([area > 0 for area in areas], axis=0) | np.all([area < 0 for area in areas], axis=0)
    u, v, w = (area[inside] for area in areas)
    height = (u * a[inside, 2] + v * b[inside, 2] + w * c[inside, 2]) / (u + v + w)
    k = np.clip(np.ceil(height), 0, len(crossings) - 1).astype(np.int64)
    np.logical_xor.at(crossings, (k, j[inside], i[inside]), True)


def _area(a: Array, b: Array, place: Array) -> Array:
    """Twice the signed area of triangles formed by two corners and a point, along i and j."""
    area: Array = (b[:, 0] - a[:, 0]) * (place[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (place[:, 0] - a[:, 0])
    return area
