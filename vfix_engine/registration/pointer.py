"""A tracked pointer: calibration of its tip, and the path that it has traced."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..geometry.path import SplinePath
from ..validate import positive, real_array, rigid_transform, whole
from .points import checked_points

FEWEST_POSES = 6
WORST_CONDITION = 20.0  # of the equations of a pivot calibration, for a swing of about 6 degrees
REST_MM = 1.0  # motion attributed to tremor of the hand at rest


@dataclass(frozen=True, eq=False)
class PivotCalibration:
    """Result of a pivot calibration.

    tip_mm: (3,) in the pointer's frame. pivot_mm: (3,) fixed position of the tip in the tracker's frame.
    residual_mm: rms distance of the tip from there; residuals_mm: (n,) of each pose.
    tip_error_mm: expected rms error of ``tip_mm``, from the residuals.
    swing_deg: swing of the pointer about the direction in which it was smallest, as the half angle of a cone.
    condition: number of the equations, at best 1.
    """

    tip_mm: Array
    pivot_mm: Array
    residual_mm: float
    residuals_mm: Array
    tip_error_mm: float
    swing_deg: float
    condition: float


def calibrate_pivot(poses: ArrayLike) -> PivotCalibration:
    """Calibrate the tip of a pointer that was swung about it while the tip was fixed.

    Least squares of R tip + p = pivot over all poses (R, p), which is linear. Its condition number is
    √((1 + s) / (1 − s)) with s the largest singular value of the mean rotation.

    Args:
        poses: (n, 4, 4), ``transform_pointer_to_tracker`` in mm, at least 6 of them.

    Raises:
        InputError: too few poses, one that is not rigid, or rotations that are too small or about only one axis.
    """
    given = checked_poses("the pointer's poses", poses, FEWEST_POSES)
    rotations, places = given[:, :3, :3], given[:, :3, 3]
    largest = min(float(np.linalg.svd(rotations.mean(axis=0), compute_uv=False)[0]), 1.0)
    condition = float(np.sqrt((1.0 + largest) / max(1.0 - largest, 1e-300)))
    swing = float(np.degrees(np.arccos(largest)))
    if condition > WORST_CONDITION:
        raise InputError(
            f"the pointer was swung by {swing:.1f} degrees only in one of the directions, which leaves its tip open; "
            "swing it by 30 degrees to all sides, with the tip in one place"
        )
    count = len(given)
    rows = np.concatenate([rotations, np.broadcast_to(-np.eye(3), (count, 3, 3))], axis=2).reshape(-1, 6)
    solution = np.linalg.lstsq(rows, -places.reshape(-1), rcond=None)[0]
    tip, pivot = solution[:3].copy(), solution[3:].copy()
    residuals = np.linalg.norm(rotations @ tip + places - pivot, axis=1)
    variance = float((residuals**2).sum()) / (3 * count - 6)
    error = np.sqrt(variance * np.trace(np.linalg.inv(rows.T @ rows)[:3, :3]))
    for array in (tip, pivot, residuals):
        array.setflags(write=False)
    rms = float(np.sqrt((residuals**2).mean()))
    return PivotCalibration(tip, pivot, rms, residuals, float(error), swing, condition)


@dataclass(frozen=True, eq=False)
class TracedPath:
    """A path traced by a pointer, as points for a plan.

    points: (k, 3) mm, interpolated by ``SplinePath(points, degree)``. residual_mm: rms distance of the samples from
    that path, largest_mm: the largest. samples: number of the pointer's samples, used: number of fitted positions,
    after rests, tremor and back-and-forth motion were removed.
    """

    points: Array
    degree: int
    length_mm: float
    residual_mm: float
    largest_mm: float
    samples: int
    used: int

    @property
    def path(self) -> SplinePath:
        """The path itself."""
        return SplinePath(self.points, self.degree)


def traced_path(points: ArrayLike, *, degree: int = 5, spacing_mm: float = 6.0, rest_mm: float = REST_MM) -> TracedPath:
    """Fit a smooth path through the samples of a pointer's tip.

    Samples within ``rest_mm`` of where the tip stopped are averaged to one position; back-and-forth motion is cut where
    the path meets itself again. A B-spline of the degree with knots every ``spacing_mm`` is fitted by least squares
    over chord length, and sampled at that spacing.

    Li & Taylor 2004, V, and Li, Ishii & Taylor 2007, V.E: a wire traced by a pointer, a B-spline of degree 5; theirs
    interpolates the samples, including their noise.

    Args:
        points: (n, 3) mm, in the order in which they were traced.
        degree: of the spline, 1 to 5; reduced for few positions.
        spacing_mm: between the points of the result; shorter features are smoothed.
        rest_mm: motion attributed to tremor.

    Raises:
        InputError: the samples are not finite points, or the tip moved by less than twice ``rest_mm``.
    """
    degree = whole("the degree of the path", degree, 1, 5)
    spacing_mm, rest_mm = positive("spacing_mm", spacing_mm), positive("rest_mm", rest_mm)
    samples = checked_points("the traced points", points, 2)
    stops = _places(samples, rest_mm)
    places = _forth(stops, rest_mm)
    if not _leads_away(places, rest_mm):
        if _leads_away(stops, rest_mm):
            raise InputError("the pointer ended where it began; stop before it is drawn back, and trace one way only")
        raise InputError(
            f"the pointer moved by less than {2.0 * rest_mm:g} mm; trace a path, and give the samples in their order"
        )
    fitted = _fitted(places, degree, spacing_mm)
    path = SplinePath(fitted, degree)
    distances = np.array([np.linalg.norm(path.closest(sample)[1] - sample) for sample in samples])
    fitted.setflags(write=False)
    rms = float(np.sqrt((distances**2).mean()))
    return TracedPath(fitted, path.degree, path.length, rms, float(distances.max()), len(samples), len(places))


def _leads_away(places: Array, rest_mm: float) -> bool:
    """Whether positions (n, 3) extend beyond a rest."""
    return len(places) > 1 and float(np.linalg.norm(places - places[0], axis=1).max()) >= 2.0 * rest_mm


def _places(samples: Array, rest_mm: float) -> Array:
    """Means (m, 3) of consecutive samples within ``rest_mm`` of the first of them."""
    groups, first = [0], samples[0]
    for number, sample in enumerate(samples):
        if np.linalg.norm(sample - first) > rest_mm:
            groups.append(number)
            first = sample
    sizes = np.diff([*groups, len(samples)])
    means: Array = np.add.reduceat(samples, groups, axis=0) / sizes[:, None]
    return means


def _forth(places: Array, rest_mm: float) -> Array:
    """Remove loops: after each position, continue from the last one within the rest distance of it."""
    kept, at = [], 0
    while at < len(places):
        kept.append(at)
        near = np.flatnonzero(np.linalg.norm(places[at:] - places[at], axis=1) <= rest_mm)
        at += int(near[-1]) + 1
    if kept[-1] != len(places) - 1:  # the path ends where the tip came to rest
        kept.append(len(places) - 1)
    return places[kept]


def _fitted(places: Array, degree: int, spacing_mm: float) -> Array:
    """Points of the least-squares spline, equally spaced."""
    from scipy.interpolate import make_lsq_spline  # imported here: slow to load

    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    order = min(degree, len(places) - 1)
    pieces = int(np.clip(round(along[-1] / spacing_mm), 1, max((len(places) - order) // 2, 1)))
    inner = np.interp(np.arange(1, pieces) / pieces * (len(along) - 1), np.arange(len(along)), along)
    knots = np.concatenate([np.full(order + 1, 0.0), inner, np.full(order + 1, along[-1])])
    spline = make_lsq_spline(along, places, knots, k=order)
    fine = spline(np.linspace(0.0, along[-1], 50 * pieces + 1))
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    count = max(int(np.ceil(arc[-1] / spacing_mm)), 1) + 1
    wanted = np.linspace(0.0, arc[-1], count)
    return np.stack([np.interp(wanted, arc, fine[:, axis]) for axis in range(3)], axis=1)


def checked_poses(what: str, poses: ArrayLike, least: int) -> Array:
    """Return copies (n, 4, 4) of rigid transforms.

    Raises:
        InputError: fewer than ``least``, another shape, or one that is not rigid.
    """
    given = real_array(what, poses)
    if given.ndim != 3 or given.shape[1:] != (4, 4):
        raise InputError(f"{what} must be rigid transforms (n, 4, 4), not {given.shape}")
    if len(given) < least:
        raise InputError(f"{len(given)} of {what} are too few; at least {least} are needed")
    return np.array([rigid_transform(pose, f"number {n} of {what}") for n, pose in enumerate(given, start=1)])
