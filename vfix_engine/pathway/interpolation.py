"""Contours between the control contours, by precomputed linear maps, so that moving a pathway costs only products."""

from __future__ import annotations

import numpy as np

from ..arrays import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)


class Interpolation:
    """Interpolation from values at increasing knots (K,) to ``count`` positions between them.

    Every interval between two knots is divided equally: if ``count − 1`` is a multiple of ``K − 1``, as for 197 and 50,
    the knots are among the positions. Cubic spline through the knots (not-a-knot; of lower degree for fewer than four);
    radii by monotone pieces.
    """

    def __init__(self, knots: Array, count: int) -> None:
        number = np.linspace(0.0, len(knots) - 1.0, count)
        near = np.round(number)
        number = np.where(np.abs(number - near) < 1e-9, near, number)
        self.piece = np.minimum(number.astype(np.intp), len(knots) - 2)  # (count,) index of the previous knot
        self.knots = knots
        self.places: Array = np.interp(number, np.arange(len(knots)), knots)
        self.value, self.rate = spline_maps(knots, self.places)
        self._gaps = np.diff(knots)
        gap, u = self._gaps[self.piece], (self.places - knots[self.piece]) / self._gaps[self.piece]
        # Cubic Hermite basis: values before and after, slopes before and after.
        basis = ((1 + 2 * u) * (1 - u) ** 2, u**2 * (3 - 2 * u), gap * u * (1 - u) ** 2, gap * u**2 * (u - 1))
        self._basis = tuple(part[:, None] for part in basis)

    def monotone(self, values: Array) -> Array:
        """(count, A) from values (K, A); each column stays between the values of its neighbouring knots.

        F. N. Fritsch and J. Butland, "A method for constructing local monotone piecewise cubic interpolants", SIAM
        Journal on Scientific and Statistical Computing 5(2), 1984.
        """
        slopes = _monotone_slopes(self._gaps[:, None], values)
        before, after = self.piece, self.piece + 1
        a, b, c, d = self._basis
        found: Array = a * values[before] + b * values[after] + c * slopes[before] + d * slopes[after]
        # Rounding must not move a radius outside the range of its neighbours.
        low, high = np.minimum(values[before], values[after]), np.maximum(values[before], values[after])
        return np.clip(found, low, high)

    def arc_lengths(self, control: Array) -> tuple[Array, Array]:
        """Arc lengths in mm of the spline through ``control`` (K, 3) at the knots (K,) and the positions (count,)."""
        grid = np.union1d(self.knots, self.places)
        half = 0.5 * np.diff(grid)
        at = (grid[:-1] + half)[:, None] + half[:, None] * _NODES
        speed = np.linalg.norm(spline_maps(self.knots, at.ravel())[1] @ control, axis=1).reshape(at.shape)
        along = np.concatenate([[0.0], np.cumsum(half * (speed @ _WEIGHTS))])
        return along[np.searchsorted(grid, self.knots)], along[np.searchsorted(grid, self.places)]


def spline_maps(knots: Array, places: Array) -> tuple[Array, Array]:
    """Matrices (len(places), len(knots)) from values at the knots to the spline's values and derivatives."""
    from scipy.interpolate import make_interp_spline  # imported here: slow to load

    spline = make_interp_spline(knots, np.eye(len(knots)), k=min(3, len(knots) - 1))
    return np.ascontiguousarray(spline(places)), np.ascontiguousarray(spline(places, nu=1))


def _monotone_slopes(gaps: Array, values: Array) -> Array:
    """Slopes (K, A) at the knots; gaps (K − 1, 1)."""
    chords = np.diff(values, axis=0) / gaps
    if len(values) == 2:
        return np.concatenate([chords, chords])
    slopes = np.zeros_like(values)
    before, after = chords[:-1], chords[1:]
    heavy, light = 2.0 * gaps[1:] + gaps[:-1], gaps[1:] + 2.0 * gaps[:-1]
    product = before * after
    # The weighted harmonic mean of two slopes of the same sign; zero at a local extremum.
    below = heavy * after + light * before
    np.divide((heavy + light) * product, below, out=slopes[1:-1], where=product > 0.0)
    slopes[0] = _end_slope(gaps[0], gaps[1], chords[0], chords[1])
    slopes[-1] = _end_slope(gaps[-1], gaps[-2], chords[-1], chords[-2])
    return slopes


def _end_slope(near: Array, far: Array, chord: Array, next_chord: Array) -> Array:
    """Slope at an end from three points, limited so that the piece stays monotone."""
    slope = ((2.0 * near + far) * chord - near * next_chord) / (near + far)
    slope = np.where(slope * chord <= 0.0, 0.0, slope)
    steep = (chord * next_chord <= 0.0) & (np.abs(slope) > 3.0 * np.abs(chord))
    return np.where(steep, 3.0 * chord, slope)
