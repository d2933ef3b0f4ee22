"""A curve in the patient frame, sampled densely by arc length and extended straight beyond its ends."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import PathwayError

_SAME = 1e-9  # [mm] neighbours closer than that coincide
_FINE = 8  # points of the spline per sample for the arc-length integration


@dataclass(frozen=True, eq=False)
class Curve:
    """Dense polyline in the patient frame; s is the arc length from its first point in mm.

    Before 0 and beyond ``length`` the curve continues straight along its end tangents.

    Args:
        points: (N, 3) mm, evenly spaced along the curve.
        step_mm: the spacing.

    Raises:
        PathwayError: fewer than two points, points that are not finite, neighbours that coincide, or a step that is
            not positive.
    """

    points: Array
    step_mm: float
    tangents: Array = field(init=False, repr=False)  # unit (N, 3) at the points

    def __post_init__(self) -> None:
        points = _checked(self.points)
        if not (np.isfinite(self.step_mm) and self.step_mm > 0.0):
            raise PathwayError(f"the step of a curve must be positive, not {self.step_mm} mm")
        ahead = np.diff(points, axis=0)
        tangents = np.empty_like(points)
        tangents[1:-1] = points[2:] - points[:-2]
        # Second-order accurate, as in the interior; two points only have the chord.
        tangents[0] = 3.0 * ahead[0] - ahead[1] if len(points) > 2 else ahead[0]
        tangents[-1] = 3.0 * ahead[-1] - ahead[-2] if len(points) > 2 else ahead[-1]
        size = np.linalg.norm(tangents, axis=1, keepdims=True)
        if size.min() <= _SAME:
            raise PathwayError(f"the curve turns back on itself at point {int(size.argmin()) + 1}")
        tangents /= size
        points.setflags(write=False)
        tangents.setflags(write=False)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "step_mm", float(self.step_mm))
        object.__setattr__(self, "tangents", tangents)

    @classmethod
    def through(cls, points: ArrayLike, step_mm: float = 0.5) -> Curve:
        """The cubic spline through points (n, 3), n ≥ 2, resampled every ``step_mm`` or a little less.

        Raises:
            PathwayError: see the class.
        """
        from scipy.interpolate import make_interp_spline  # imported here: slow to load

        control = _checked(points)
        if not (np.isfinite(step_mm) and step_mm > 0.0):
            raise PathwayError(f"the step of a curve must be positive, not {step_mm} mm")
        chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(control, axis=0), axis=1))])
        spline = make_interp_spline(chord, control, k=min(3, len(control) - 1))
        fine = np.linspace(0.0, chord[-1], _FINE * max(int(np.ceil(chord[-1] / step_mm)), len(control)) + 1)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spline(fine), axis=0), axis=1))])
        pieces = max(int(np.ceil(along[-1] / step_mm - 1e-9)), 1)
        even = np.interp(np.linspace(0.0, along[-1], pieces + 1), along, fine)
        return cls(spline(even), float(along[-1] / pieces))

    @property
    def length(self) -> float:
        """Arc length in mm."""
        return (len(self.points) - 1) * self.step_mm

    def position(self, s: ArrayLike) -> Array:
        """Points at the arc lengths s (scalar or (m,)): (3,) or (m, 3) mm; extrapolated straight beyond the ends."""
        places = _finite(s)
        index, share = self._between(places)
        share = share[..., None]
        inside = (1.0 - share) * self.points[index] + share * self.points[index + 1]
        before, beyond = np.minimum(places, 0.0)[..., None], np.maximum(places - self.length, 0.0)[..., None]
        found: Array = inside + before * self.tangents[0] + beyond * self.tangents[-1]
        return found

    def tangent(self, s: ArrayLike) -> Array:
        """Unit tangents at the arc lengths s (scalar or (m,)): (3,) or (m, 3)."""
        index, share = self._between(_finite(s))
        share = share[..., None]
        found: Array = (1.0 - share) * self.tangents[index] + share * self.tangents[index + 1]
        found /= np.linalg.norm(found, axis=-1, keepdims=True)
        return found

    def closest(self, point: ArrayLike, near_s: float | None = None, window: float | None = None) -> float:
        """Arc length in [0, length] of the point of the curve nearest to ``point`` (3,).

        With ``near_s`` and ``window`` only the arc within ``window`` mm of ``near_s`` is searched, so that a
        neighbouring loop of the lumen is never mistaken for the position.

        Raises:
            PathwayError: the point is not finite, or the window does not overlap the curve.
        """
        target = np.asarray(point, dtype=np.float64)
        low, high = 0.0, self.length
        if near_s is not None and window is not None:
            low, high = max(near_s - window, low), min(near_s + window, high)
        if target.shape != (3,) or not (np.isfinite(target).all() and low <= high):
            raise PathwayError(f"no nearest point on the curve to {target} between {low:g} and {high:g} mm")
        first = min(int(low / self.step_mm), len(self.points) - 2)
        last = max(min(int(np.ceil(high / self.step_mm)), len(self.points) - 1), first + 1)
        start, along = self.points[first:last], np.diff(self.points[first : last + 1], axis=0)
        share = np.einsum("ij,ij->i", target - start, along) / np.einsum("ij,ij->i", along, along)
        share = np.clip(share, 0.0, 1.0)
        away = target - start - share[:, None] * along
        best = int(np.einsum("ij,ij->i", away, away).argmin())
        return float(min(max((first + best + share[best]) * self.step_mm, low), high))

    def bending(self, window_mm: float = 4.0) -> Array:
        """Curvature (N,) in 1/mm at the points: rotation of the tangent over ``window_mm`` of the curve, per length.

        Raises:
            PathwayError: the window is not positive.
        """
        if not (np.isfinite(window_mm) and window_mm > 0.0):
            raise PathwayError(f"the window of a curvature must be positive, not {window_mm} mm")
        half = min(max(round(0.5 * window_mm / self.step_mm), 1), len(self.points) - 1)
        number = np.arange(len(self.points))
        low, high = np.maximum(number - half, 0), np.minimum(number + half, len(number) - 1)
        apart = np.linalg.norm(self.tangents[high] - self.tangents[low], axis=1)
        turn = 2.0 * np.arcsin(np.minimum(0.5 * apart, 1.0))
        curvature: Array = turn / ((high - low) * self.step_mm)
        return curvature

    def _between(self, places: Array) -> tuple[NDArray[np.intp], Array]:
        """Index of the sample before each arc length, and the fraction of the interval to the next one."""
        steps = np.clip(places / self.step_mm, 0.0, len(self.points) - 1)
        index = np.minimum(steps.astype(np.intp), len(self.points) - 2)
        return index, steps - index


def _checked(points: ArrayLike) -> Array:
    """Return a validated copy (n, 3) of the points."""
    control = np.array(points, dtype=np.float64, order="C")
    if control.ndim != 2 or control.shape[1] != 3 or len(control) < 2:
        raise PathwayError(f"a curve needs at least two points (n, 3), not {control.shape}")
    if not np.isfinite(control).all():
        bad = int(np.flatnonzero(~np.isfinite(control).all(axis=1))[0])
        raise PathwayError(f"point {bad + 1} of the curve is not finite")
    same = np.flatnonzero(np.linalg.norm(np.diff(control, axis=0), axis=1) <= _SAME)
    if len(same):
        raise PathwayError(f"points {same[0] + 1} and {same[0] + 2} of the curve are in the same place; drop one")
    return control


def _finite(s: ArrayLike) -> Array:
    places = np.asarray(s, dtype=np.float64)
    if not np.isfinite(places).all():
        raise PathwayError("an arc length is not finite")
    return places
