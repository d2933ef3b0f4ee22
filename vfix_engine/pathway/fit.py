"""Control contours of a pathway, fitted to a lumen's surface along a curve through it.

Kwok 2013, section IV.A, placed 50 contours manually; here they are computed by ray casting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..anatomy.lumen.wall import Wall, free_distance, outward_side
from ..arrays import Array
from ..errors import PathwayError
from ..geometry.curve import Curve
from ..geometry.mesh import TriangleMesh
from ..geometry.transport import transported
from ..validate import point_text, whole, within
from .checks import MOST_ANGLES, MOST_CONTOURS, MOST_FITTED, rim_points
from .interpolation import Interpolation, spline_maps
from .pathway import Pathway
from .uncross import uncrossed

_STEP = 2.0  # [mm] spacing of the positions at which the lumen is measured
_RAYS = 48  # per position; as many as a polar contour has radii, if that is what is fitted
_SMOOTH = 8.0  # [mm] smoothing length of curvature and measured width
_SPREAD = 0.1  # density of contours per mm where the lumen is straight and uniform; see _laid
_SLOPE = 1.0  # ... per slope of the width
_DAMPED = 0.7  # step towards the nearest point of the spline, as a fraction of its distance, in each round
_ROUNDS = 5  # of fitting the spline and projecting each position of the curve to it
_POLAR_CUT = 1.5  # limit of a polar radius in medians, into the mouth of a haustrum or a branch
_BEND_CUT = 0.9  # limit of a radius on the inner side of a bend, as a fraction of the bend's radius
_CLEAR = 2.0  # [mm] distance from the wall at which the spline is held
_END_MM = 30.0  # weight of a radian between the end directions of curve and spline, relative to a mm between them
_HELD = 9.0  # weight of a held position, relative to 1 of one that only follows the curve
_BEHIND = 3.0  # [mm] behind the wall, which is soft, at which a curve has left the lumen
_STILL_BEHIND = 1.0  # ... and the spline, which is held off the wall


def fit_pathway(
    mesh: TriangleMesh,
    curve: Curve,
    contours: int = 50,
    interpolated: int = 197,
    angles: int = 1,
    quantile: float = 0.3,
    keep_mm: float = 0.0,
    least_mm: float = 1.0,
) -> Pathway:
    """Fit contours along ``curve``, closer together where it bends and where the lumen's width changes.

    The centres lie on the spline nearest to the curve; the first and last are its ends. A contour represents its
    interval, halfway to its neighbours: its radius is a quantile of the distances to the wall there.

    Args:
        mesh: the lumen's surface, triangles consistently oriented.
        curve: through the lumen; the path that the robot will follow.
        contours: number of control contours, 2 to 1,000.
        interpolated: number of contours of the pathway after interpolation, 2 to 5,000.
        angles: 1 for circles; 3 to 720 for as many radii around each contour.
        quantile: of the distances to the wall within a contour's interval, in all directions for a circle and in its
            own direction for a polar radius: 0 gives the inscribed contour, including folds; higher values ignore
            folds, which are thin and soft.
        keep_mm: subtracted from every radius.
        least_mm: lower bound of the radii, also where the curve touches the wall.

    Raises:
        PathwayError: the curve leaves the lumen, or a number is out of range; and as ``Pathway``.
    """
    _check_numbers(contours, interpolated, angles, quantile, keep_mm, least_mm)
    wall = Wall(mesh)
    s, width, outward = _width(wall, curve)
    _check_inside(wall, outward, curve.position(s), s, _BEHIND)
    at = _laid(curve, s, width, contours)
    control = _nearest_spline(wall, outward, curve, at)
    parts = max(int(np.ceil(np.diff(at).max() / _STEP)), 4)
    fine = Interpolation(at, parts * (contours - 1) + 1)
    centre, tangent = fine.value @ control, _unit(fine.rate @ control)
    first = transported(centre, tangent)
    around = _around(tangent, first, _RAYS if angles == 1 else angles)
    distance, side = wall.seen(np.broadcast_to(centre[:, None], around.shape), around)
    _check_inside(wall, outward, centre, fine.places, _STILL_BEHIND)
    seen = np.minimum(free_distance(distance, side, outward), _inner_side(centre, tangent, around))
    radius = _radii(seen, parts, angles, quantile)
    if not np.isfinite(radius).all():
        nowhere = int(np.flatnonzero(~np.isfinite(radius).all(axis=1))[0])
        raise PathwayError(
            f"no wall is seen around the curve at {at[nowhere]:.1f} mm: close the surface there, or end the path before"
        )
    radius = np.maximum(radius - keep_mm, least_mm)
    return uncrossed(Interpolation(at, interpolated), control, radius, first[0], least_mm)


@dataclass(frozen=True, eq=False)
class Containment:
    """Fraction of a pathway's surface that lies outside the lumen; both fractions are of its area.

    behind: fraction not visible from the pathway's centre, behind a fold or the wall.
    outside: fraction outside the lumen. depth_mm: (median, 95 %, maximum) of its distance to the wall.
    deepest_mm: (C,) of each contour's rim behind the wall; 0 where it stays within the lumen.
    """

    behind: float
    outside: float
    depth_mm: tuple[float, float, float]
    deepest_mm: Array


def containment(mesh: TriangleMesh, pathway: Pathway) -> Containment:
    """Measure how much of the pathway at rest lies outside the lumen, sampled at the rims of its contours."""
    wall, found = Wall(mesh), pathway.contours()
    radius = found.radius if found.radius.shape[1] > 1 else np.tile(found.radius, (1, _RAYS))
    rim, cosine, sine = rim_points(radius)
    second = np.cross(found.tangent, found.first)
    ray = cosine[:, None] * found.first[:, None] + sine[:, None] * second[:, None]
    distance, side = wall.seen(found.centre[:, None], ray)
    outward = outward_side(side)
    area = rim * np.gradient(found.s)[:, None]
    area /= area.sum()
    behind = rim > free_distance(distance, side, outward)
    points = (found.centre[:, None] + rim[..., None] * ray)[behind]
    clear = wall.clearance(points, outward)[0]
    beyond = clear < 0.0
    depth = -clear[beyond] if beyond.any() else np.zeros(1)
    worst = tuple(float(value) for value in np.quantile(depth, (0.5, 0.95, 1.0)))
    deepest = np.zeros(behind.shape)
    deepest[behind] = np.maximum(-clear, 0.0)
    outside = float(area[behind][beyond].sum())
    return Containment(float(area[behind].sum()), outside, (worst[0], worst[1], worst[2]), deepest.max(axis=1))


def _check_numbers(
    contours: int, interpolated: int, angles: int, quantile: float, keep_mm: float, least_mm: float
) -> None:
    whole("the number of contours that are fitted", contours, 2, MOST_FITTED, PathwayError)
    whole("the number of interpolated contours", interpolated, 2, MOST_CONTOURS, PathwayError)
    if whole("the number of radii of a contour", angles, 1, MOST_ANGLES, PathwayError) == 2:
        raise PathwayError("a contour has 1 radius, or at least 3 around its centre; not 2")
    within("the quantile", quantile, 0.0, 1.0, PathwayError)
    if not (np.isfinite(keep_mm) and np.isfinite(least_mm) and keep_mm >= 0.0 and least_mm > 0.0):
        raise PathwayError(f"keep_mm must not be negative and least_mm be positive, not {keep_mm} and {least_mm}")


def _width(wall: Wall, curve: Curve) -> tuple[Array, Array, int]:
    """Arc lengths (n,), the lumen's width (n,) there in mm, and the side from which the wall is visible."""
    s = np.linspace(0.0, curve.length, max(round(curve.length / _STEP), 2) + 1)
    centre, tangent = curve.position(s), curve.tangent(s)
    around = _around(tangent, transported(centre, tangent), _RAYS // 2)
    distance, side = wall.seen(np.broadcast_to(centre[:, None], around.shape), around)
    outward = outward_side(side)
    width = np.quantile(free_distance(distance, side, outward), 0.3, axis=1, method="lower")
    closed = np.isfinite(width)
    if not closed.any():
        raise PathwayError("the curve sees no wall around itself: it does not lie in this lumen; give one that does")
    # At an opening the width is undefined: use the median of the lumen.
    return s, np.where(closed, width, np.median(width[closed])), outward


def _laid(curve: Curve, s: Array, width: Array, contours: int) -> Array:
    """Arc lengths (contours,) that divide the required density of contours equally.

    Between positions h apart a straight pathway deviates from a bend of curvature κ by κh²/8, so the density grows with
    √κ; with |R'| for the width. ``_SPREAD`` is the density on straight sections.
    """
    from scipy.ndimage import gaussian_filter1d  # imported here: slow to load

    step = s[1] - s[0]
    slope = np.abs(np.gradient(gaussian_filter1d(width, _SMOOTH / step, mode="nearest"), step))
    bending = np.interp(s, np.arange(len(curve.points)) * curve.step_mm, curve.bending(_SMOOTH))
    need = _SPREAD + np.sqrt(gaussian_filter1d(bending, _SMOOTH / step, mode="nearest")) + _SLOPE * slope
    total = np.concatenate([[0.0], np.cumsum(0.5 * (need[1:] + need[:-1]) * step)])
    at: Array = np.interp(np.linspace(0.0, total[-1], contours), total, s)
    at[0], at[-1] = 0.0, curve.length
    return at


def _nearest_spline(wall: Wall, outward: int, curve: Curve, at: Array) -> Array:
    """Centres (K, 3) at the knots (K,) of the spline nearest to the curve; the ends are the curve's.

    Least squares over equally spaced positions of the curve, each relative to the nearest point of the spline: a spline
    through points of the curve itself would oscillate between them, with twice the error. It starts and ends in the
    curve's direction, which is that of a robot in front of it. Where the spline is closer to the wall than ``_CLEAR``,
    or behind it, the targets are moved that much inwards.
    """
    places = np.linspace(0.0, curve.length, max(int(np.ceil(curve.length / _STEP)), 8 * len(at)) + 1)
    wanted, pushed, places = curve.position(places), np.zeros((len(places), 3)), places.copy()
    control = curve.position(at)
    if len(at) == 2:
        return control
    slope = _END_MM * spline_maps(at, at[[0, -1]])[1]
    ends = _END_MM * curve.tangent(at[[0, -1]]) - slope[:, [0, -1]] @ control[[0, -1]]
    for _ in range(_ROUNDS):
        value, rate = spline_maps(at, places)
        weight = np.append(np.where(pushed.any(axis=1), _HELD, 1.0), [1.0, 1.0])[:, None]
        rest = np.concatenate([wanted + pushed - value[:, [0, -1]] @ control[[0, -1]], ends])
        inner = np.concatenate([value, slope])[:, 1:-1]
        control[1:-1] = np.linalg.solve(inner.T @ (weight * inner), inner.T @ (weight * rest))
        found, speed = value @ control, rate @ control
        ahead = np.einsum("ij,ij->i", wanted - found, speed) / np.einsum("ij,ij->i", speed, speed)
        places = np.maximum.accumulate(np.clip(places + _DAMPED * ahead, 0.0, curve.length))
        places[0], places[-1] = 0.0, curve.length
        clear, inward = wall.clearance(found, outward)
        pushed += np.maximum(_CLEAR - clear, 0.0)[:, None] * inward
    return control


def _around(tangent: Array, first: Array, rays: int) -> Array:
    """Unit directions (n, rays, 3) at equally spaced polar angles."""
    psi = 2.0 * np.pi * np.arange(rays) / rays
    second = np.cross(tangent, first)
    directions: Array = np.cos(psi)[:, None] * first[:, None] + np.sin(psi)[:, None] * second[:, None]
    return directions


def _inner_side(centre: Array, tangent: Array, around: Array) -> Array:
    """Distance (n, rays) in each direction up to which contour planes do not meet: a fraction of the bend's radius."""
    step = np.linalg.norm(np.diff(centre, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(step)])
    half = max(round(0.5 * _SMOOTH / float(np.median(step))), 1)
    low, high = np.maximum(np.arange(len(centre)) - half, 0), np.minimum(np.arange(len(centre)) + half, len(centre) - 1)
    bend = (tangent[high] - tangent[low]) / (along[high] - along[low])[:, None]  # curvature vector, to the inner side
    towards = np.einsum("nri,ni->nr", around, bend)
    return np.asarray(np.divide(_BEND_CUT, towards, out=np.full(towards.shape, np.inf), where=towards > 1e-9))


def _radii(seen: Array, parts: int, angles: int, quantile: float) -> Array:
    """Radii (K, angles) from ray distances (n, rays) at positions of which every ``parts``-th is a contour."""
    radii = []
    for middle in range(0, len(seen), parts):
        stretch = seen[max(middle - parts // 2, 0) : middle + parts // 2 + 1]
        if angles == 1:
            radii.append(np.quantile(stretch, quantile, keepdims=True, method="lower").reshape(1))
        else:
            radii.append(np.quantile(stretch, quantile, axis=0, method="lower"))
    radius = np.array(radii)
    if angles == 1:
        return radius
    radius = np.minimum(radius, _POLAR_CUT * np.median(radius, axis=1, keepdims=True))
    # Smoothing over the angle may only reduce radii.
    smooth = 0.25 * (np.roll(radius, 1, axis=1) + 2.0 * radius + np.roll(radius, -1, axis=1))
    return np.minimum(radius, smooth)


def _check_inside(wall: Wall, outward: int, centre: Array, places: Array, most: float) -> None:
    clear = wall.clearance(centre, outward)[0]
    if clear.min() < -most:
        worst = int(clear.argmin())
        raise PathwayError(
            f"the curve leaves the lumen: at {places[worst]:.0f} mm, {point_text(centre[worst])}, it is "
            f"{-clear[worst]:.1f} mm behind the wall, more than {most:g} mm; look whether the surface is whole there, "
            "or fit more contours"
        )


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit
