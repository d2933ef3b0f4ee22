"""Distance fields cropped to the tool's range and quantised to 0.01 mm, for transfer and storage."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from .distance_field import DistanceField, FieldGrid

UNIT_MM = 0.01  # quantum of a stored distance
_NOT_KNOWN = -32768
_LONGEST = 32000  # [unit]


def compact_field(field: DistanceField, focus: ArrayLike, further_mm: float, low: float, high: float) -> DistanceField:
    """Crop the first and the last grid of a field to the surroundings of a box, and quantise them to 0.01 mm.

    Args:
        focus: (2, 3) LPS corners [mm]. The first grid is cropped to it, the last one to `further_mm` around it.
        low, high: distances [mm] are clipped to this range, which must include all distances whose gradient is needed.

    Raises InputError if a cropped grid has less than two points along an axis.
    """
    box = np.asarray(focus, dtype=np.float64)
    grids = [_cut(field.grids[0], box)]
    if len(field.grids) > 1:
        grids.append(_cut(field.grids[-1], np.add(box, [[-further_mm], [further_mm]])))
    return DistanceField([FieldGrid(_rounded(grid.values, low, high), grid.origin, grid.step_mm) for grid in grids])


def stored_values(values: NDArray[np.float32]) -> NDArray[np.int16] | NDArray[np.float32]:
    """Return the values of a grid as int16 in units of 0.01 mm if that is exact, else unchanged."""
    units = np.where(np.isnan(values), _NOT_KNOWN, np.rint(np.nan_to_num(values, posinf=0.0, neginf=0.0) / UNIT_MM))
    if (np.abs(units) > -_NOT_KNOWN).any():
        return values
    stored = units.astype(np.int16)
    return stored if np.array_equal(values_of(stored), values, equal_nan=True) else values


def values_of(stored: NDArray[np.int16] | NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the values in mm: the inverse of ``stored_values``."""
    if stored.dtype != np.int16:
        return np.asarray(stored, dtype=np.float32)
    values = stored.astype(np.float32) * np.float32(UNIT_MM)
    values[stored == _NOT_KNOWN] = np.nan
    return values


def _rounded(values: NDArray[np.float32], low: float, high: float) -> NDArray[np.float32]:
    units = np.clip(values, low, high)
    np.divide(units, np.float32(UNIT_MM), out=units)
    np.rint(units, out=units)
    np.clip(units, -_LONGEST, _LONGEST, out=units)
    units[np.isnan(units)] = _NOT_KNOWN
    return values_of(units.astype(np.int16))


def _cut(grid: FieldGrid, box: Array) -> FieldGrid:
    count = np.array(grid.values.shape[::-1])
    first = np.clip(np.floor((box[0] - grid.origin) / grid.step_mm + 1e-6).astype(int), 0, count)
    last = np.clip(np.ceil((box[1] - grid.origin) / grid.step_mm - 1e-6).astype(int) + 1, 0, count)
    part = tuple(slice(a, b) for a, b in zip(first[::-1], last[::-1], strict=True))
    return FieldGrid(grid.values[part].copy(), grid.origin + grid.step_mm * first, grid.step_mm)
