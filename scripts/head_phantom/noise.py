"""Smooth seeded noise, a pure function of position, so that a part of the head equals that part of the whole."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from head_phantom.blending import Field

Axis = npt.NDArray[np.float64]


class SmoothNoise:
    """Noise of unit variance on a lattice of one wavelength [mm], interpolated by cubic B-splines."""

    def __init__(self, seed: int, wavelength: float, low: Axis, high: Axis) -> None:
        counts = np.ceil((high - low) / wavelength).astype(int) + 6
        lattice = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal(counts[::-1]), 0.6)
        self._lattice: Field = (lattice / lattice.std()).astype(np.float32)
        self._start = low - 2.0 * wavelength
        self._wavelength = wavelength

    def at(self, x: Axis, y: Axis, z: Axis) -> Field:
        """Return values (K, J, I) on the grid of the three axes [mm]."""
        values: Field = self._lattice
        for dimension, axis in enumerate((z, y, x)):
            values = self._interpolated(values, axis, dimension, self._start[2 - dimension])
        return values

    def _interpolated(self, values: Field, axis: Axis, dimension: int, start: float) -> Field:
        position = (axis - start) / self._wavelength
        cell = np.floor(position).astype(int)
        t = position - cell
        weights = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
        shape = [1, 1, 1]
        shape[dimension] = -1
        last = values.shape[dimension] - 1
        blended: Field = np.zeros(1, dtype=np.float32)
        for offset, weight in enumerate(weights):
            lattice_plane = np.take(values, np.clip(cell + offset - 1, 0, last), axis=dimension)
            blended = blended + lattice_plane * (weight / 6).astype(np.float32).reshape(shape)
        return blended
