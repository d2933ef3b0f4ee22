"""Trilinear sampling of a volume: at points, and over a plane (compiled, single-threaded)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.kernels.compiled import compiled, inlined, nogil

# Tolerance [voxels] beyond the outermost voxel centres for rounding of the mapping.
_EDGE = 1e-6


@inlined
def _trilinear(hu: Any, x: float, y: float, z: float, outside: float) -> float:
    """HU at the fractional index (x, y, z) = (i, j, k)."""
    count_k, count_j, count_i = hu.shape
    top_x, top_y, top_z = count_i - 1, count_j - 1, count_k - 1
    if not (-_EDGE <= x <= top_x + _EDGE and -_EDGE <= y <= top_y + _EDGE and -_EDGE <= z <= top_z + _EDGE):
        return outside
    x, y, z = min(max(x, 0.0), top_x), min(max(y, 0.0), top_y), min(max(z, 0.0), top_z)
    i, j, k = min(int(x), top_x - 1), min(int(y), top_y - 1), min(int(z), top_z - 1)
    fx, fy, fz = x - i, y - j, z - k
    near = (hu[k, j, i] * (1 - fx) + hu[k, j, i + 1] * fx) * (1 - fy)
    near += (hu[k, j + 1, i] * (1 - fx) + hu[k, j + 1, i + 1] * fx) * fy
    far = (hu[k + 1, j, i] * (1 - fx) + hu[k + 1, j, i + 1] * fx) * (1 - fy)
    far += (hu[k + 1, j + 1, i] * (1 - fx) + hu[k + 1, j + 1, i + 1] * fx) * fy
    return float(near * (1 - fz) + far * fz)


@nogil
def _points(hu: Any, points: Any, origin: Any, to_index: Any, outside: float) -> Any:
    values = np.empty(points.shape[0])
    for n in range(points.shape[0]):
        x, y, z = points[n, 0] - origin[0], points[n, 1] - origin[1], points[n, 2] - origin[2]
        i = (to_index[0, 0] * x + to_index[0, 1] * y) + to_index[0, 2] * z
        j = (to_index[1, 0] * x + to_index[1, 1] * y) + to_index[1, 2] * z
        k = (to_index[2, 0] * x + to_index[2, 1] * y) + to_index[2, 2] * z
        values[n] = _trilinear(hu, i, j, k, outside)
    return values


@compiled
def _plane(hu: Any, start: Any, column: Any, row: Any, height: int, width: int, outside: float) -> Any:
    values = np.empty((height, width), np.float32)
    for r in range(height):
        x0, y0, z0 = start[0] + r * row[0], start[1] + r * row[1], start[2] + r * row[2]
        for c in range(width):
            values[r, c] = _trilinear(hu, x0 + c * column[0], y0 + c * column[1], z0 + c * column[2], outside)
    return values


def sample_points(
    hu: npt.NDArray[np.int16],
    points: npt.NDArray[np.float64],
    origin: npt.NDArray[np.float64],
    to_index: npt.NDArray[np.float64],
    outside: float,
) -> npt.NDArray[np.float64]:
    """Trilinear values (n,) of hu (K, J, I) at points (n, 3).

    origin: position of the first voxel's centre; to_index: (3, 3), from a point relative to it to fractional (i, j, k).
    """
    # One memory layout, read-only: another one would be compiled as another kernel at its first use.
    placed, start, matrix = (_read_only(np.ascontiguousarray(array)) for array in (points, origin, to_index))
    values: npt.NDArray[np.float64] = _points(_read_only(hu), placed, start, matrix, outside)
    return values


def sample_plane(
    hu: npt.NDArray[np.int16],
    start: npt.NDArray[np.float64],
    column: npt.NDArray[np.float64],
    row: npt.NDArray[np.float64],
    shape: tuple[int, int],
    outside: float,
) -> npt.NDArray[np.float32]:
    """Trilinear values (h, w) of hu (K, J, I) at start + c * column + r * row, all fractional indices i, j, k."""
    if column[0] == 0.0 and row[0] == 0.0 and 0.0 <= start[0] <= hu.shape[2] - 1:
        # A plane of constant i strides through the whole volume. Copying its two layers first is three times faster.
        first = min(int(start[0]), hu.shape[2] - 2)
        hu = np.ascontiguousarray(hu[:, :, first : first + 2])
        start = start - np.array([first, 0.0, 0.0])
    values: npt.NDArray[np.float32] = _plane(hu, start, column, row, shape[0], shape[1], outside)
    return values


def _read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    view = array.view()
    view.setflags(write=False)
    return view
