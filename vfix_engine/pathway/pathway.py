"""The constraint pathway: contours along a lumen, at rest or moved by the tissue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import PathwayError
from ..geometry.curve import Curve
from ..geometry.transport import across, double_reflection
from ..validate import real, real_array, whole
from .checks import MOST_CONTOURS, check_neighbours, checked_control
from .interpolation import Interpolation, spline_maps
from .packed import PackedPathway, pack
from .windows_kernel import put_windows

# (arc lengths (C,) of control contours in mm, time in s) → displacements (C, 3) in mm, factors (C,) of the radii
TissueMotion = Callable[[Array, float], tuple[Array, Array]]

_BACK = -1.0 + 1e-9  # cosine of a rotation with an undefined axis
_SAME = 1e-6  # of the spacing of ``wall_radius``: tolerance so that rounding includes no additional sample
_CURVE_SPACING = 2.0  # [mm] approximate spacing of the spline points that form the curve


@dataclass(frozen=True, eq=False)
class Contours:
    """Contours at one moment, patient frame.

    s: (C,) arc length of the pathway at rest, mm; negative or beyond the length for the straight segments at the ends.
    centre: (C, 3) mm. tangent: (C, 3) unit. first: (C, 3) unit, direction of the polar angle 0, parallel transported.
    radius: (C, A) mm.
    """

    s: Array
    centre: Array
    tangent: Array
    first: Array
    radius: Array


@dataclass(frozen=True, eq=False)
class Pathway:
    """A lumen as contours along a centreline P(s) with tangent M(s), Kwok 2013, section III.A; patient frame, mm.

    Args:
        centre: (C0, 3) centres of the control contours; Kwok 2013's P_k.
        radius: (C0,) or (C0, 1) radii of circles, or (C0, A) with A ≥ 3 radii R_j(ρ̂) at the polar angles 2πa/A.
        count: number of contours after interpolation, up to 5,000; of 197 every fourth is one of 50 control contours.
        tangent: (C0, 3) unit normals of the contours; None: the tangents of the spline through the centres.
        first: (3,) direction whose projection is the polar angle 0 of the first contour; None: arbitrary.
        motion: moves the control contours with time (``tissue_motion``); None: a pathway at rest.
        knots: (C0,) increasing parameter of the control contours, such as the arc length of the curve along which they
            were placed; None: the chord lengths of the centres at rest.
        closed_ends: if False, ``packed`` is extended straight at both ends by two radii, because the ends of the
            paper's window would otherwise count as wall.
        wall_radius: (M,) mm at equally spaced arc lengths from 0 to ``length``, radius of the lumen's surface there,
            infinite above the range of interest: contours do not represent constrictions between two of them. It
            narrows no contour, but is used by ``narrowest_between`` and the links' bounds. None: unknown.

    Raises:
        PathwayError: contours for which the query is undefined; see ``checks``. Also raised when a moved pathway is
            computed.
    """

    centre: Array
    radius: Array
    count: int = 197
    tangent: Array | None = None
    first: Array | None = None
    motion: TissueMotion | None = None
    knots: Array | None = None
    closed_ends: bool = False
    wall_radius: Array | None = None
    at_s: Array = field(init=False)  # (C0,) arc length of the control contours at rest, mm
    s: Array = field(init=False)  # (count,) arc length of the interpolated contours at rest, mm
    _between: Interpolation = field(init=False, repr=False)
    _rest: PackedPathway = field(init=False, repr=False)

    def __post_init__(self) -> None:
        centre, radius, tangent = checked_control(self.centre, self.radius, self.tangent)
        count = whole("the number of interpolated contours", self.count, 1, MOST_CONTOURS, PathwayError)
        if count < 2:
            raise PathwayError(f"a pathway is interpolated to at least 2 contours, not {count}")
        if not (self.motion is None or callable(self.motion)):
            raise PathwayError(f"a motion is a function of arc lengths and time, not {self.motion!r:.60}")
        between = Interpolation(_knots(self.knots, centre), count)
        at_s, s = between.arc_lengths(centre)
        wall_radius = _wall_radius(self.wall_radius)
        settled: dict[str, Any] = {
            "centre": centre,
            "radius": radius,
            "tangent": tangent,
            "at_s": at_s,
            "s": s,
            "wall_radius": wall_radius,
            "_between": between,
        }
        settled |= {"knots": between.knots, "first": _direction(self.first), "count": count}
        for name, value in settled.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_rest", self._packed(0.0))

    @property
    def length(self) -> float:
        """Arc length from the first contour to the last at rest, mm."""
        return float(self.s[-1])

    def contours(self, t: float = 0.0, extended: bool = False) -> Contours:
        """Return the interpolated contours (count) at the time t in s.

        extended: add one contour before the first and one after the last, offset straight by two of its largest radii,
            unless the pathway's ends are closed, as in ``packed``.

        Raises:
            PathwayError: the motion returns unusable numbers; or a tangent vanishes.
        """
        control, radius = self._control(t)
        between = self._between
        centre = between.value @ control
        tangent = _unit(between.rate @ control)
        if self.tangent is not None:
            # Given normals rotate with the tissue, as the spline's tangent does.
            given = _unit(between.value @ self.tangent)
            tangent = given if self.motion is None else _turned(given, _unit(between.rate @ self.centre), tangent)
        first = np.empty_like(centre)
        double_reflection(centre, tangent, across(tangent[0], self.first), first)
        found = Contours(self.s, centre, tangent, first, between.monotone(radius))
        return _extended(found) if extended and not self.closed_ends else found

    def packed(self, t: float = 0.0) -> PackedPathway:
        """Return the pathway in the layout of the query, at the time t in s.

        Segment 0 is the straight one before the first contour, unless the ends are closed.

        Raises:
            PathwayError: contours of the moved pathway cross or face away from each other.
        """
        return self._rest if self.motion is None or t == 0.0 else self._packed(t)

    def curve(self, t: float = 0.0) -> Curve:
        """Return the spline through the centres at the time t in s as a dense curve."""
        pieces = max(int(np.ceil(self.length / _CURVE_SPACING)), self.count)
        fine = Interpolation(self._between.knots, pieces + 1).places
        return Curve.through(spline_maps(self._between.knots, fine)[0] @ self._control(t)[0])

    def along(self, curve: Curve | None, s: Array) -> Array:
        """Arc lengths (n,) in mm of the curve that a robot follows, of arc lengths (n,) of the pathway at rest.

        curve: along which the control contours were placed, as ``knots`` says. The spline through their centres has
            another length. None, or a pathway that moves: the robot follows that spline itself.
        """
        if curve is None or self.motion is not None:
            return s
        knots = self._between.knots - self._between.knots[0]
        found: Array = np.interp(s, self.at_s, knots * (curve.length / knots[-1]))
        return found

    def window(self, s_low: float, s_high: float) -> tuple[int, int]:
        """Segments [first, last) of ``packed`` that the arc from s_low to s_high mm meets, and one more on each side.

        The additional ones, where they exist, keep the ends of the window away from the arc: at an end the deviation of
        a point is its distance to the rim. At least one segment, and never more than exist.

        Raises:
            PathwayError: an arc length is not finite, or s_low exceeds s_high.
        """
        first, last = self.windows(np.array([s_low], dtype=np.float64), np.array([s_high], dtype=np.float64))[
            0
        ].tolist()
        return first, last

    def windows(self, s_low: Array, s_high: Array) -> NDArray[np.int64]:
        """``window`` of many arcs (L,) at once: (L, 2).

        Raises:
            PathwayError: see ``window``.
        """
        found = np.empty((len(s_low), 2), dtype=np.int64)
        bad = put_windows(self.s, s_low, s_high, 0 if self.closed_ends else 1, len(self._rest.rows), found)
        if bad >= 0:
            raise PathwayError(f"no window from {s_low[bad]} to {s_high[bad]} mm")
        return found

    def narrowest_between(self, s_low: Array, s_high: Array) -> Array:
        """Smallest ``wall_radius`` (n,) between arc lengths (n,) of the pathway at rest; infinite if there is none."""
        if self.wall_radius is None:
            return np.full(len(s_low), np.inf)
        last = len(self.wall_radius) - 1
        share = np.clip(np.stack([s_low, s_high]) / self.length, 0.0, 1.0) * last
        first = np.minimum(np.floor(share[0] + _SAME).astype(np.int64), last)
        beyond = np.ceil(share[1] - _SAME).astype(np.int64) + 1
        found: Array = np.minimum.reduceat(np.append(self.wall_radius, np.inf), np.stack([first, beyond], 1).ravel())
        return found[::2]

    def moved(self, motion: TissueMotion | None) -> Pathway:
        """Return the same pathway with another motion."""
        return replace(self, motion=motion)

    def _packed(self, t: float) -> PackedPathway:
        found = self.contours(t, extended=True)
        check_neighbours(found.centre, found.tangent, found.first, found.radius, self._pair)
        return pack(found.centre, found.tangent, found.first, found.radius)

    def _control(self, t: float) -> tuple[Array, Array]:
        """Centres (C0, 3) and radii (C0, A) of the control contours at the time t."""
        if self.motion is None:
            return self.centre, self.radius
        found: Any = self.motion(self.at_s, real("a time in s", t, PathwayError))
        if not isinstance(found, tuple) or len(found) != 2:
            raise PathwayError(f"the tissue's motion gives displacements and factors, not {found!r:.60}")
        shift, factor = (real_array("the tissue's motion", one, PathwayError) for one in found)
        if shift.shape != self.centre.shape or factor.shape != self.at_s.shape:
            wanted = f"{self.centre.shape} and {self.at_s.shape}"
            raise PathwayError(f"the tissue's motion has the shapes {shift.shape} and {factor.shape}, not {wanted}")
        bad = np.flatnonzero(~(np.isfinite(shift).all(axis=1) & (factor > 0.0) & np.isfinite(factor)))
        if len(bad):
            values = f"displacement {shift[bad[0]]} mm, factor {factor[bad[0]]}"
            raise PathwayError(f"the tissue's motion at t = {t:g} s cannot be used at contour {bad[0] + 1}: {values}")
        return self.centre + shift, self.radius * factor[:, None]

    def _pair(self, pair: int) -> str:
        """Describe a pair of neighbours among the contours of ``packed``."""
        before = pair if self.closed_ends else pair - 1
        if before < 0 or before >= self.count - 1:
            return f"the {'first' if before < 0 else 'last'} contour and the straight end"
        if self.count == len(self.centre):
            return f"contours {before + 1} and {before + 2}"
        control = int(self._between.piece[before]) + 1
        return f"contours {before + 1} and {before + 2} of {self.count} (from control contour {control} on)"


def _knots(given: ArrayLike | None, centre: Array) -> Array:
    if given is None:
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centre, axis=0), axis=1))])
    knots = real_array("the knots of a pathway", given, PathwayError)
    if knots.shape != (len(centre),) or not np.isfinite(knots).all() or np.diff(knots).min() <= 0.0:
        raise PathwayError(f"the knots of {len(centre)} contours must be as many numbers that increase")
    return knots


def _wall_radius(given: ArrayLike | None) -> Array | None:
    if given is None:
        return None
    radius = real_array("the radius of a lumen by its surface", given, PathwayError).copy()
    if radius.ndim != 1 or len(radius) < 2 or not (radius >= 0.0).all():
        raise PathwayError(
            f"the radius of a lumen by its surface is (M,) mm with M ≥ 2, none negative, not {radius.shape}"
        )
    return radius


def _direction(given: ArrayLike | None) -> Array | None:
    if given is None:
        return None
    direction = real_array("the direction of the polar angle 0", given, PathwayError)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise PathwayError(f"the direction of the polar angle 0 cannot be {direction}")
    return direction


def _unit(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=1)
    if size.min() <= 1e-9:
        raise PathwayError(f"the pathway has no direction at its contour {int(size.argmin()) + 1}")
    unit: Array = vectors / size[:, None]
    return unit


def _turned(vectors: Array, before: Array, after: Array) -> Array:
    """Rotate vectors (C, 3), each by the smallest rotation from one unit vector to another."""
    axis, cosine = np.cross(before, after), np.einsum("ij,ij->i", before, after)
    if not cosine.min() > _BACK:
        raise PathwayError(f"the pathway turns back at its contour {int(cosine.argmin()) + 1}")
    once = np.cross(axis, vectors)
    return _unit(vectors + once + np.cross(axis, once) / (1.0 + cosine)[:, None])


def _extended(found: Contours) -> Contours:
    """Add a contour straight before the first and one after the last, offset by two of its largest radii."""
    head, tail = 2.0 * float(found.radius[0].max()), 2.0 * float(found.radius[-1].max())
    repeated = np.concatenate([[0], np.arange(len(found.s)), [len(found.s) - 1]])
    centre = found.centre[repeated]
    centre[0] -= head * found.tangent[0]
    centre[-1] += tail * found.tangent[-1]
    s = np.concatenate([[found.s[0] - head], found.s, [found.s[-1] + tail]])
    return Contours(s, centre, found.tangent[repeated], found.first[repeated], found.radius[repeated])
