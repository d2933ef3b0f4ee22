"""Control contours that an operator adds to those of a fit, or puts in their place.

Kwok 2013, section IV.A, had all contours placed by hand; here they are fitted, and an operator changes some.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import PathwayError
from ..geometry.curve import Curve
from ..validate import point, point_text, real_array
from .checks import MOST_ANGLES
from .interpolation import Interpolation, spline_maps
from .pathway import Pathway
from .uncross import uncrossed

OFF_THE_WAY_MM = 40.0  # from the curve: a contour placed for a farther place belongs to another way
FARTHEST_MM = 60.0  # that a contour's centre is moved from its place on the way
LARGEST_MM = 150.0  # radius of a contour: wider than any bowel
LEAST_MM = 1.0  # down to which a radius is reduced where a contour would cross its neighbour
_APART_MM = 0.5  # least distance between two contours along the curve
_BEND_MM = 36.0  # radius of the sharpest bend that moving a contour makes: of 28 mm links of ± 45°, see ``follow``
_LEAST_SPREAD_MM = 15.0
_CUT_MM = 1e-6


@dataclass(frozen=True, eq=False)
class HandContour:
    """A contour placed by hand, patient frame, mm.

    at: (3,) place on the way that it is for. radius: (1,) of a circle, (A,) polar radii at the angles 2πa/A with A ≥ 3;
    none: the fitted contour is left out.
    centre: (3,) to which it is moved; its neighbours that were not moved by hand go along, less the farther they are
    away. None: it lies on the way.
    of_fit: it takes the place of the fitted contour that is nearest to ``at`` along the way; else it is one more.

    Raises:
        PathwayError: a place or radius that is not a finite number, a radius that is not positive or more than 150 mm,
            two radii, or a centre more than 60 mm from ``at``.
    """

    at: Array
    radius: Array
    centre: Array | None = None
    of_fit: bool = False

    def __post_init__(self) -> None:
        at = point("the place of a contour", self.at)
        centre = at if self.centre is None else point("the centre of a contour", self.centre)
        radius = real_array("the radii of a contour", self.radius, PathwayError)
        if radius.ndim != 1 or len(radius) == 2 or len(radius) > MOST_ANGLES:
            raise PathwayError(f"a contour has one radius, or 3 to {MOST_ANGLES} around its centre")
        if not (np.isfinite(radius) & (radius > 0.0)).all():
            raise PathwayError("the radii of a contour must be finite and positive, in mm")
        if radius.max(initial=0.0) > LARGEST_MM:
            raise PathwayError(f"a contour has the radius {radius.max():g} mm; at most {LARGEST_MM:g} mm are possible")
        if not len(radius) and not self.of_fit:
            raise PathwayError("a contour that is added has a radius")
        away = float(np.linalg.norm(centre - at))
        if away > FARTHEST_MM:
            raise PathwayError(
                f"the centre {point_text(centre)} is {away:.0f} mm from the contour's place on the way; at most "
                f"{FARTHEST_MM:g} mm are possible"
            )
        for name, value in (("at", at), ("radius", radius), *([] if self.centre is None else [("centre", centre)])):
            value.setflags(write=False)
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class EditedPathway:
    """A fitted pathway with contours placed by hand.

    pathway: at rest. curve: the robot's, which goes along with contours that were moved.
    fit_knots: (C0,) arc lengths in mm of the control contours on the curve of the fit.
    at_mm: (C0,) mm along the curve that the robot follows, see ``Pathway.along``.
    of_hand: (C0,) number of the contour placed by hand that a control contour is; −1: a fitted one.
    cut_mm: (C0,) by how much a radius was reduced so that it does not cross its neighbour.
    changed: whether any contour placed by hand counts.
    left_out: numbers of contours placed by hand that are too far from the way to belong to it.
    """

    pathway: Pathway
    curve: Curve
    fit_knots: Array
    at_mm: Array
    of_hand: NDArray[np.int64]
    cut_mm: Array
    changed: bool
    left_out: tuple[int, ...] = ()

    def nearest(self, s_mm: float) -> int:
        """Number of the control contour nearest to a length along the curve that the robot follows.

        Raises:
            PathwayError: a length that is not on it.
        """
        if not 0.0 <= s_mm <= self.at_mm[-1] + _APART_MM:
            raise PathwayError(f"{s_mm:g} mm are not on the way, which is {self.at_mm[-1]:.0f} mm long")
        return int(np.abs(self.at_mm - s_mm).argmin())


def with_hand_contours(fit: Pathway, curve: Curve, contours: Sequence[HandContour]) -> EditedPathway:
    """Put contours placed by hand among those of a fit.

    Args:
        fit: the fitted pathway; its knots are arc lengths of ``curve``. Of its motion only counts whether there is one:
            a robot in it follows the pathway's own centres.
        curve: the robot's. contours: of two in the place of one fitted contour the later counts.

    Raises:
        PathwayError: the first or the last contour is moved or left out, contours are too close or too far apart, or
            cross their neighbours even with radii of 1 mm.
    """
    moves, fit = fit.motion is not None, fit.moved(None)
    assert fit.knots is not None
    knots, owner = fit.knots, np.full(len(fit.knots), -1)
    on_curve = [_on_curve(curve, contour) for contour in contours]
    left_out = tuple(number for number, s in enumerate(on_curve) if s is None)
    added = []
    for number, (contour, s) in enumerate(zip(contours, on_curve, strict=True)):
        if s is None:
            continue
        nearest = int(np.abs(knots - s).argmin())
        if contour.of_fit or abs(knots[nearest] - s) < _APART_MM:
            owner[nearest] = number
        else:
            added.append((s, number))
    if not added and (owner < 0).all():
        at_mm = fit.along(None if moves else curve, fit.at_s)
        return EditedPathway(fit, curve, knots, at_mm, owner, np.zeros(len(knots)), False, left_out)
    _check_ends(fit, contours, owner)
    at = np.concatenate([knots, [s for s, _ in added]])
    of_hand = np.concatenate([owner, [number for _, number in added]]).astype(np.int64)
    kept = [k for k in np.argsort(at, kind="stable") if of_hand[k] < 0 or len(contours[of_hand[k]].radius)]
    at, of_hand = at[kept], of_hand[kept]
    close = np.flatnonzero(np.diff(at) < _APART_MM)
    if len(close):
        raise PathwayError(f"two contours lie at the same place, {at[close[0]]:.1f} mm along the way; move one away")
    return _edited(fit, curve, contours, at, of_hand, left_out, moves)


def _on_curve(curve: Curve, contour: HandContour) -> float | None:
    s = curve.closest(contour.at)
    return s if float(np.linalg.norm(curve.position(s) - contour.at)) <= OFF_THE_WAY_MM else None


def _check_ends(fit: Pathway, contours: Sequence[HandContour], owner: NDArray[np.int64]) -> None:
    for end in (0, -1):
        if owner[end] < 0:
            continue
        contour = contours[owner[end]]
        moved = contour.centre is not None and np.linalg.norm(contour.centre - fit.centre[end]) > _APART_MM
        if moved or not len(contour.radius):
            raise PathwayError(
                "the first and the last contour stay at the ends of the way: choose another entry or end instead"
            )


def _edited(
    fit: Pathway,
    curve: Curve,
    contours: Sequence[HandContour],
    at: Array,
    of_hand: NDArray[np.int64],
    left_out: tuple[int, ...],
    moves: bool,
) -> EditedPathway:
    """The pathway of the control contours at the arc lengths (K,) of the curve, each fitted or placed by hand."""
    assert fit.knots is not None
    fitted = spline_maps(fit.knots, at)[0] @ fit.centre
    hand = [None if number < 0 else contours[number] for number in of_hand]
    shift = _shifts(at, fitted, [None if one is None else one.centre for one in hand])
    centre = fitted + shift
    angles = max([fit.radius.shape[1], *(len(one.radius) for one in hand if one is not None)])
    own = dict(zip(fit.knots.tolist(), fit.radius, strict=True))
    given = [own[float(s)] if one is None else one.radius for s, one in zip(at, hand, strict=True)]
    radius = np.array([_around(one, angles) for one in given])
    knots, driven = at, curve
    if np.abs(shift).max() > _CUT_MM:
        driven, knots = _moved_curve(curve, at, shift)
    pieces = max(round((fit.count - 1) / (len(fit.knots) - 1)), 1)
    first = fit.contours().first[0]
    pathway = uncrossed(Interpolation(knots, pieces * (len(at) - 1) + 1), centre, radius, first, LEAST_MM)
    cut = np.maximum(radius - pathway.radius, 0.0).max(axis=1)
    at_mm = pathway.along(None if moves else driven, pathway.at_s)
    return EditedPathway(pathway, driven, at, at_mm, of_hand, np.where(cut > _CUT_MM, cut, 0.0), True, left_out)


def _shifts(at: Array, fitted: Array, moved: Sequence[Array | None]) -> Array:
    """Displacements (K, 3) mm of contours at the arc lengths (K,), some of which are moved to a place of their own.

    The others go along by half a cosine, over so great a length that a straight way bends with ``_BEND_MM`` at least;
    the ends stay.
    """
    total, weights = np.zeros_like(fitted), np.zeros(len(at))
    for s, place, centre in zip(at, fitted, moved, strict=True):
        if centre is None:
            continue
        shift = centre - place
        spread = spread_mm(float(np.linalg.norm(shift)))
        weight = 0.5 + 0.5 * np.cos(np.pi * np.minimum(np.abs(at - s) / spread, 1.0))
        total += weight[:, None] * shift
        weights += weight
    shifts: Array = total / np.maximum(weights, 1.0)[:, None]
    shifts[[0, -1]] = 0.0
    for number, centre in enumerate(moved):
        if centre is not None:
            shifts[number] = centre - fitted[number]
    return shifts


def spread_mm(moved_mm: float) -> float:
    """How far along the way contours go along with one that is moved by so much."""
    return float(max(_LEAST_SPREAD_MM, np.pi * np.sqrt(0.5 * _BEND_MM * moved_mm)))


def _around(radius: Array, angles: int) -> Array:
    """Radii (A,) at other angles, between the given ones linear over the angle."""
    if len(radius) in (1, angles):
        return np.broadcast_to(radius, angles)
    turn = np.arange(angles) / angles
    found: Array = np.interp(turn, np.arange(len(radius)) / len(radius), radius, period=1.0)
    return found


def _moved_curve(curve: Curve, at: Array, shift: Array) -> tuple[Curve, Array]:
    """The curve displaced by (K, 3) mm at its arc lengths (K,), smoothly between, and the new arc lengths there."""
    from scipy.interpolate import PchipInterpolator  # imported here: slow to load

    s = np.arange(len(curve.points)) * curve.step_mm
    points = curve.points + PchipInterpolator(at, shift)(s)
    moved = Curve.through(points)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return moved, np.interp(at, s, along * (moved.length / along[-1]))
