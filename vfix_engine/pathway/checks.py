"""Requirements of a constraint pathway, under which every step of the query is valid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import PathwayError
from ..validate import real_array

_SAME = 1e-9  # [mm] centres closer than that coincide
_UNIT = 1e-6  # tolerance of the length of a given unit tangent
FACING = 0.1  # smallest M·e: only if it is positive does (2) of the query point to the point's own side
_RIM = 24  # smallest number of rim points at which crossing is tested
MOST_CONTOURS = 5_000  # control and interpolated ones, for which matrices are stored; more indicates a typing error
MOST_FITTED = 1_000  # every 2 mm of a colon; least squares of more take minutes
MOST_ANGLES = 720  # radii of a contour, every half degree
_LEAST_RADIUS_MM = 0.2  # a lumen that is narrower everywhere, or shorter than the next value, is in metres
_LEAST_LENGTH_MM = 1.0
LARGEST_COORDINATE_MM = 1e9  # above which products of several numbers overflow


def checked_control(
    centre: ArrayLike, radius: ArrayLike, tangent: ArrayLike | None
) -> tuple[Array, Array, Array | None]:
    """Return read-only copies of control contours: centres (C, 3), radii (C, A), tangents (C, 3) or None.

    Raises:
        PathwayError: values that are not numbers, wrong shapes, fewer than two contours or more than 5,000, NaN or
            infinity, a radius that is not positive, a lumen so small that it must be in metres, tangents that are not
            unit vectors, two centres that coincide, or a gap between neighbours.
    """
    places = real_array("the centres of a pathway", centre, PathwayError)
    radii = real_array("the radii of a pathway", radius, PathwayError)
    radii = radii[:, None] if radii.ndim == 1 else radii
    if places.ndim != 2 or places.shape[1] != 3 or radii.ndim != 2 or len(radii) != len(places):
        raise PathwayError(f"a pathway needs centres (C, 3) and radii (C, A), not {places.shape} and {radii.shape}")
    if len(places) < 2:
        raise PathwayError(f"a pathway needs at least 2 contours, not {len(places)}")
    if len(places) > MOST_CONTOURS:
        raise PathwayError(f"a pathway has at most {MOST_CONTOURS:,} control contours, not {len(places):,}")
    if radii.shape[1] == 2:
        raise PathwayError("a contour has one radius, or at least 3 around its centre; not 2")
    _finite("centre", places)
    _finite("radius", radii)
    number, angle = np.unravel_index(int(radii.argmin()), radii.shape)
    if radii[number, angle] <= 0.0:
        where = "" if radii.shape[1] == 1 else f" at angle {angle + 1} of {radii.shape[1]}"
        raise PathwayError(
            f"contour {number + 1} has the radius {radii[number, angle]:g} mm{where}; it must be positive"
        )
    _not_in_metres(places, radii)
    along = None
    if tangent is not None:
        along = real_array("the tangents of a pathway", tangent, PathwayError)
        if along.shape != places.shape:
            raise PathwayError(f"tangents have the shape {along.shape}, the centres {places.shape}")
        _finite("tangent", along)
        size = np.linalg.norm(along, axis=1)
        bad = int(np.abs(size - 1.0).argmax())
        if abs(size[bad] - 1.0) > _UNIT:
            raise PathwayError(f"the tangent of contour {bad + 1} has the length {size[bad]:g}, not 1")
        along /= size[:, None]
        along.setflags(write=False)
    _spacing(places, radii)
    places.setflags(write=False)
    radii.setflags(write=False)
    return places, radii, along


def check_neighbours(centre: Array, tangent: Array, first: Array, radius: Array, name: Callable[[int], str]) -> None:
    """Refuse contours that face away from a neighbour or cross it.

    Args:
        centre, tangent, first, radius: as in ``packed.pack``.
        name: names the pair of contours j and j + 1 in a message.

    Raises:
        PathwayError: M·e of a contour and the direction to its neighbour is 0.1 or less; or a point of a contour's rim
            lies on the wrong side of its neighbour's plane.
    """
    along = centre[1:] - centre[:-1]
    length = np.linalg.norm(along, axis=1)
    if not length.min() > _SAME:  # also refuses NaN
        raise PathwayError(
            f"{name(int(length.argmin()))} have the same centre {_point(centre[int(length.argmin())])} mm"
        )
    ahead = np.einsum("ij,ij->i", tangent[:-1], along), np.einsum("ij,ij->i", tangent[1:], along)
    facing = np.minimum(*ahead) / length
    if not facing.min() > FACING:
        worst = int(facing.argmin())
        angle = np.degrees(np.arccos(np.clip(facing[worst], -1.0, 1.0)))
        raise PathwayError(
            f"{name(worst)} do not face each other: a tangent and the line between the centres are {angle:.0f}° apart, "
            f"at most {np.degrees(np.arccos(FACING)):.0f}° are possible"
        )
    margin = clear_of_neighbours(ahead, tangent, first, radius)
    if not margin.min() > 0.0:
        worst = int(margin.argmin())
        raise PathwayError(
            f"{name(worst)} cross: a rim of radius {radius[worst : worst + 2].max():.3g} mm reaches "
            f"{-margin[worst]:.3g} mm behind the other's plane, {length[worst]:.3g} mm from centre to centre; "
            "make the radii smaller or the bend wider"
        )


def clear_of_neighbours(ahead: tuple[Array, Array], tangent: Array, first: Array, radius: Array) -> Array:
    """Smallest distance (C − 1,) in mm of two neighbours' rims from each other's plane, negative behind it.

    ahead: distances (C − 1,) of contour j + 1's centre from the plane of j, and of j's centre from the plane of j + 1.
    """
    if radius.shape[1] == 1:
        sine = np.linalg.norm(np.cross(tangent[:-1], tangent[1:]), axis=1)
        return np.asarray(np.minimum(ahead[0] - radius[1:, 0] * sine, ahead[1] - radius[:-1, 0] * sine))
    second = np.cross(tangent, first)
    rim, cosine, sine_ = rim_points(radius)
    reach = []
    for here, there, sign in ((slice(1, None), slice(None, -1), 1.0), (slice(None, -1), slice(1, None), -1.0)):
        x = np.einsum("ij,ij->i", tangent[there], first[here])[:, None]
        y = np.einsum("ij,ij->i", tangent[there], second[here])[:, None]
        reach.append((sign * rim[here] * (x * cosine + y * sine_)).min(axis=1))
    return np.asarray(np.minimum(ahead[0] + reach[0], ahead[1] + reach[1]))


def rim_points(radius: Array) -> tuple[Array, Array, Array]:
    """Radii (C, K) at K ≥ 24 equally spaced angles of contours (C, A), and the angles' cosines and sines (K,)."""
    angles = radius.shape[1]
    parts = -(-_RIM // angles)
    share = np.arange(parts) / parts
    following = np.roll(radius, -1, axis=1)
    rim = (radius[:, :, None] * (1.0 - share) + following[:, :, None] * share).reshape(len(radius), -1)
    psi = 2.0 * np.pi * np.arange(rim.shape[1]) / rim.shape[1]
    return rim, np.cos(psi), np.sin(psi)


def _finite(what: str, values: Array) -> None:
    good = (np.abs(values) <= LARGEST_COORDINATE_MM).all(axis=1)
    if not good.all():
        bad = int(np.flatnonzero(~good)[0])
        if np.isfinite(values[bad]).all():
            raise PathwayError(f"the {what} of contour {bad + 1} is {values[bad].tolist()} mm: that is no place")
        raise PathwayError(f"the {what} of contour {bad + 1} is not finite")


def _not_in_metres(centre: Array, radius: Array) -> None:
    with np.errstate(over="ignore"):
        length = float(np.linalg.norm(np.diff(centre, axis=0), axis=1).sum())
    if radius.max() < _LEAST_RADIUS_MM or length < _LEAST_LENGTH_MM:
        raise PathwayError(
            f"the pathway is {length:.3g} mm long and nowhere more than {radius.max():.3g} mm in radius: "
            "is it in millimetres?"
        )


def _spacing(centre: Array, radius: Array) -> None:
    apart = np.linalg.norm(np.diff(centre, axis=0), axis=1)
    if apart.min() <= _SAME:
        same = int(apart.argmin())
        raise PathwayError(f"contours {same + 1} and {same + 2} have the same centre {_point(centre[same])} mm")
    largest = radius.max(axis=1)
    # Between contours the pathway is straight: distant ones do not determine the lumen between them.
    most = 4.0 * np.maximum(largest[1:], largest[:-1]) + 10.0 * float(np.median(apart))
    if (apart > most).any():
        gap = int((apart - most).argmax())
        raise PathwayError(
            f"there is a gap of {apart[gap]:.4g} mm between contours {gap + 1} and {gap + 2}; with their radii and the "
            f"spacing of the others {most[gap]:.4g} mm are possible"
        )


def _point(values: Array) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in values) + ")"
