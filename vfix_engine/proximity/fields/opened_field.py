"""Distance field of a solid from which shapes are removed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...geometry.shape_distance import signed_distance
from ...geometry.shape_surface import border_triangles
from ...geometry.shapes import Shape
from .distance_field import DistanceField, FieldGrid

_AROUND_MM = 10.0  # distance from a shape up to which the depth in the remaining solid is corrected


def opened_field(field: DistanceField, shapes: Sequence[Shape]) -> DistanceField:
    """Remove shapes from a field's solid: the maximum of its distance and of the depth in the shape.

    Outside the remaining solid the result never exceeds the true distance. Unknown points stay unknown.

    Raises:
        InputError: a shape is a half-space.
    """
    grids = list(field.grids)
    for shape in shapes:
        corners = border_triangles(shape, 2.0).reshape(-1, 3)
        if not len(corners):  # the shape is smaller than the resolution of floats
            continue
        low, high = corners.min(axis=0) - _AROUND_MM, corners.max(axis=0) + _AROUND_MM
        grids = [_opened(grid, shape, low, high) for grid in grids]
    return DistanceField(grids) if shapes else field


def _opened(grid: FieldGrid, shape: Shape, low: Array, high: Array) -> FieldGrid:
    counts = np.array(grid.values.shape[::-1])
    first = np.clip(np.floor((low - grid.origin) / grid.step_mm).astype(int), 0, counts)
    last = np.clip(np.ceil((high - grid.origin) / grid.step_mm).astype(int) + 1, first, counts)
    if (last <= first).any():
        return grid
    axes = [grid.origin[k] + grid.step_mm * np.arange(first[k], last[k]) for k in range(3)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")  # in the index order of the values
    points = np.stack([x, y, z], axis=-1)
    depth = -signed_distance(shape, points.reshape(-1, 3)).reshape(points.shape[:3])
    values = np.array(grid.values)
    part = tuple(slice(a, b) for a, b in zip(first[::-1], last[::-1], strict=True))
    values[part] = np.maximum(values[part], depth.astype(values.dtype))  # propagates NaN
    values.setflags(write=False)
    return replace(grid, values=values)
