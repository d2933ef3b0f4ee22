"""Resampling of slices that are shifted within their planes, as by a gantry tilt, to a rectangular grid.

Each slice is moved only within its own plane; nothing is interpolated between slices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array
from vfix_engine.files.grid_header import check_sizes
from vfix_engine.files.volume import AIR_HU, BONE_HU, to_hu

Hounsfield = npt.NDArray[np.int16]

_WIDTH = 3  # half width of the Lanczos window: six samples
_WHOLE = 1e-3  # [pixel] tolerance within which a shift is an integer and needs no interpolation
_MEASURED_SLICES = 24
_SHARE = 99.0  # [%] percentile of the displacement of the border of bone that is reported as the error


def aligned(slices: Sequence[Hounsfield], shifts: Array) -> tuple[Hounsfield, Array]:
    """Shift the slices (rows, columns), each by its row (columns, rows) of `shifts` (n, 2), in pixels.

    Returns the (n, rows, columns) voxels of a grid that covers all of them, air outside the slices, and the (2,) shift
    (columns, rows) of that grid's first pixel. Raises ImageError if the grid would be too large.
    """
    start = shifts.min(axis=0)
    extra = np.ceil(np.ptp(shifts, axis=0) - _WHOLE).astype(int)
    rows, columns = slices[0].shape[0] + int(extra[1]), slices[0].shape[1] + int(extra[0])
    check_sizes([columns, rows, len(slices)])
    placed = np.full((len(slices), rows, columns), AIR_HU, dtype=np.int16)
    for target, one, shift in zip(placed, slices, shifts - start, strict=True):
        _place(target, one, shift)
    return placed, start


def alignment_error_mm(slices: Sequence[Hounsfield], shifts: Array, pixel_mm: Array) -> float:
    """Estimate the displacement of the border of bone by resampling, in mm, from slices distributed over the series.

    The border is located by this interpolation and by linear interpolation, the less accurate of the two; their
    distance is the difference of their Hounsfield units over the gradient, where neighbouring pixels are on both sides
    of the threshold. Half a pixel if there is no bone.
    """
    chosen = np.unique(np.linspace(0, len(slices) - 1, _MEASURED_SLICES).round().astype(int))
    found = [_moved_mm(slices[n], shifts[n] - np.floor(shifts[n]), pixel_mm) for n in chosen]
    moved = np.concatenate(found)
    return float(np.percentile(moved, _SHARE)) if moved.size else 0.5 * float(np.max(pixel_mm))


def _place(target: Hounsfield, one: Hounsfield, shift: Array) -> None:
    """Write a slice, shifted by (columns, rows) >= 0 pixels, into a larger one."""
    values = one.astype(np.float32)
    first = []
    for axis, by in ((0, shift[1]), (1, shift[0])):
        whole = round(by) if abs(by - round(by)) < _WHOLE else math.ceil(by)
        if (fraction := whole - by) >= _WHOLE:
            values = _advanced(values, _lanczos(fraction), axis)
        first.append(whole)
    rows, columns = values.shape
    target[first[0] : first[0] + rows, first[1] : first[1] + columns] = to_hu(values)


def _advanced(values: npt.NDArray[np.float32], weights: Array, axis: int) -> npt.NDArray[np.float32]:
    """Values between each pixel and the next one along an axis, which gets shorter by one; edges are repeated."""
    beside = len(weights) // 2 - 1
    padding = [(0, 0), (0, 0)]
    padding[axis] = (beside, beside)
    wide = np.moveaxis(np.pad(values, padding, mode="edge"), axis, 0)
    count = values.shape[axis] - 1
    mixed = np.zeros((count, *wide.shape[1:]), dtype=np.float32)
    for number, weight in enumerate(weights):
        mixed += np.float32(weight) * wide[number : number + count]
    return np.moveaxis(mixed, 0, axis)


def _lanczos(fraction: float) -> Array:
    """Weights (6,) of the pixels around a position that is `fraction` of a pixel after the third.

    Their sum is 1 and their mean position is that one, so that linear ramps are reproduced.
    """
    away = np.arange(1 - _WIDTH, _WIDTH + 1) - fraction
    weights: Array = np.sinc(away) * np.sinc(away / _WIDTH)
    weights /= weights.sum()
    off = float(weights @ away)
    weights[_WIDTH - 1] += off
    weights[_WIDTH] -= off
    return weights


def _moved_mm(one: Hounsfield, shift: Array, pixel_mm: Array) -> Array:
    """Distances [mm] between the borders of bone by both interpolations."""
    better = worse = one.astype(np.float32)
    for axis, fraction in ((0, 1.0 - shift[1]), (1, 1.0 - shift[0])):
        if _WHOLE <= fraction <= 1.0 - _WHOLE:
            better = _advanced(better, _lanczos(fraction), axis)
            worse = _advanced(worse, np.array([1.0 - fraction, fraction]), axis)
    off = np.abs(better - worse)
    slope = np.hypot(*np.gradient(better, pixel_mm[1], pixel_mm[0]))
    found = []
    for axis in (0, 1):
        pairs = [np.moveaxis(values, axis, 0) for values in (better, off, slope)]
        (a, b), (off_a, off_b), (slope_a, slope_b) = ((values[:-1], values[1:]) for values in pairs)
        steep = np.maximum(np.maximum(slope_a, slope_b), np.abs(b - a) / pixel_mm[1 - axis])
        border = (a < BONE_HU) != (b < BONE_HU)
        found.append((np.maximum(off_a, off_b) / np.maximum(steep, 1e-6))[border])
    return np.concatenate(found).astype(np.float64)
