"""Path through the anatomy: an interpolating B-spline, parameterised by arc length."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import PlanError
from .checks import out_of_range
from .path_kernels import arc_table, closest_on_path, sample

_TABLE_STEP_MM = 0.1  # mm between the entries of the arc-length table
_MAX_ENTRIES = 50_000  # largest number of entries of the table
_COINCIDENT_MM = 1e-9  # control points closer than that coincide


class SplinePath:
    """B-spline through control points in the patient frame; s is the arc length from the first point in mm.

    Args:
        points: (n, 3) mm, at least two; neighbours are distinct.
        degree: of the spline, reduced to n − 1 for fewer points.

    Raises:
        PlanError: too few points, points that are not finite or a kilometre away, or two neighbours that coincide.
    """

    def __init__(self, points: ArrayLike, degree: int = 5):
        control = np.array(points, dtype=np.float64, order="C")
        if control.ndim != 2 or control.shape[1] != 3 or len(control) < 2:
            raise PlanError(f"a path needs at least two points (n, 3), not {control.shape}")
        if not np.isfinite(control).all():
            bad = int(np.flatnonzero(~np.isfinite(control).all(axis=1))[0])
            raise PlanError(f"point {bad + 1} of the path is not finite")
        if far := out_of_range(control):
            raise PlanError(f"point {far[0] + 1} of the path {far[1]}")
        if degree < 1:
            raise PlanError(f"a path has degree 1 or more, not {degree}")
        chords = np.linalg.norm(np.diff(control, axis=0), axis=1)
        same = np.flatnonzero(chords <= _COINCIDENT_MM)
        if len(same):
            raise PlanError(
                f"points {same[0] + 1} and {same[0] + 2} of the path are in the same place; move one of them"
            )
        control.setflags(write=False)
        self.points, self.degree = control, min(degree, len(control) - 1)
        from scipy.interpolate import make_interp_spline  # imported here: slow to load

        # With chord lengths as parameter ‖dp/du‖ is near 1 and the curve does not oscillate between unevenly spaced
        # points.
        spline = make_interp_spline(np.concatenate([[0.0], np.cumsum(chords)]), control, k=self.degree)
        breaks = np.unique(spline.t)
        powers = range(self.degree, -1, -1)
        # Taylor coefficients about each piece's start: (piece, power, axis).
        terms = [spline(breaks[:-1], nu=power) / math.factorial(power) for power in powers]
        coefficients = np.ascontiguousarray(np.stack(terms, axis=1))
        total = float(breaks[-1] - breaks[0])
        step = max(_TABLE_STEP_MM, total / _MAX_ENTRIES)
        self._curve = (breaks, coefficients)
        self._table = arc_table(breaks, coefficients, step)

    @property
    def length(self) -> float:
        """Length of the whole path in mm."""
        return float(self._table[1][-1])

    def position(self, s: ArrayLike) -> Array:
        """Points at the arc lengths s (scalar or (m,)): (3,) or (m, 3); s outside [0, length] gives the end."""
        return self._sampled(s, 0)

    def tangent(self, s: ArrayLike) -> Array:
        """Unit tangents at the arc lengths s (scalar or (m,)): (3,) or (m, 3)."""
        return self._sampled(s, 1)

    def closest(
        self, point: ArrayLike, near_s: float | None = None, window: float | None = None
    ) -> tuple[float, Array, Array]:
        """Arc length, position (3,) and unit tangent (3,) of the path's point nearest to ``point`` (3,).

        With ``near_s`` and ``window`` only the arc within ``window`` mm of ``near_s`` is searched, so that progress
        does not jump to another branch of the path. Otherwise the whole path is searched.

        Raises:
            PlanError: a point or an arc length is not finite.
        """
        target = np.array(point, dtype=np.float64)
        low, high = 0.0, self.length
        if near_s is not None and window is not None:
            low, high = max(near_s - window, low), min(near_s + window, high)
        if target.shape != (3,) or not (np.isfinite(target).all() and low <= high):
            raise PlanError(f"no nearest point on the path to {target} between {low:g} and {high:g} mm")
        found = closest_on_path(*self._curve, *self._table, target, low, high)
        return float(found[0]), found[1:4], found[4:7]

    def _sampled(self, s: ArrayLike, order: int) -> Array:
        places = np.asarray(s, dtype=np.float64)
        if not np.isfinite(places).all():
            raise PlanError("an arc length is not finite")
        values: Array = sample(*self._curve, *self._table, np.atleast_1d(places), order)
        return values[0] if places.ndim == 0 else values
