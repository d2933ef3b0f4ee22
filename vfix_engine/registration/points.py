"""Registration by pairs of points: the rigid transform, what remains at the pairs, and the error elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import InputError
from ..validate import FARTHEST_MM, real_array, rigid_transform, within
from .expected_error import ball_radius, largest_squares, motion_rows, pose_covariance, residual_share
from .rigid_fit import residual_lengths, rigid_fits

Side = Literal["moving", "fixed"]

COINCIDENT_MM = 0.01  # two points nearer than that are one
ON_A_LINE = 0.01  # spread across the points' line divided by the spread along it
_SIDES = ("moving", "fixed")


@dataclass(frozen=True, eq=False)
class Registration:
    """The rigid transform that fits pairs of points, in mm. Arrays are read-only.

    FRE tells how well the pairs fit, not how far a target is off: the two are independent of each other, and with more
    points FRE grows while TRE shrinks. For a target ask ``tre_mm``.

    transform: (4, 4), takes a point of the moving frame to the fixed frame.
    fixed, moving: (n, 3) the pairs, each in its frame.
    weights: (n,) of the pairs' squared residuals; those of weight 0 did not take part.

    Raises:
        InputError: as ``register_points``, or the transform is not rigid.
    """

    transform: Array
    fixed: Array
    moving: Array
    weights: Array

    def __post_init__(self) -> None:
        fixed, moving, weights = checked_pairs(self.fixed, self.moving, self.weights)
        transform = rigid_transform(self.transform, "the registration's transform")
        named = (("transform", transform), ("fixed", fixed), ("moving", moving), ("weights", weights))
        for name, array in named:
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @cached_property
    def residuals_mm(self) -> Array:
        """Distance (n,) of each fixed point from its placed moving point, also of pairs with weight 0."""
        lengths = residual_lengths(self.fixed, self.moving, self.transform[:3, :3], self.transform[:3, 3])
        lengths.setflags(write=False)
        return lengths

    @property
    def count(self) -> int:
        """Number of pairs with a positive weight."""
        return int(np.count_nonzero(self.weights))

    @property
    def fre_mm(self) -> float:
        """Fiducial registration error: √ of the mean of the squared residuals, over the pairs with positive weight.

        It is not weighted: each of these pairs counts alike.
        """
        return float(np.sqrt((self.residuals_mm[self.weights > 0.0] ** 2).mean()))

    @property
    def mean_residual_mm(self) -> float:
        """Mean of the residuals' lengths over the pairs with positive weight; at most ``fre_mm``."""
        return float(self.residuals_mm[self.weights > 0.0].mean())

    @property
    def fle_mm(self) -> float:
        """Rms localisation error (length) that explains ``fre_mm``: FRE / √(1 − 2/n) where the weights are equal.

        For other weights 1 − 2/n is replaced by the exact expectation of that fit. Three pairs leave three degrees of
        freedom (3n − 6), so there always is an estimate; it is rough, with a relative standard deviation of about
        1/√(2 (3n − 6)): 41 % for 3 pairs and 24 % for 5.
        """
        used = self.weights > 0.0
        return self.fre_mm / float(np.sqrt(residual_share(self.moving[used], self.weights[used])))

    def explained_by(self, fle_mm: float, share: float = 0.999) -> bool:
        """Whether residuals as large as these are to be expected of pairs with that localisation error.

        False where fewer than 1 − ``share`` of such fits would leave as much: then the error is larger than was said,
        or the pairs are not each other's. With three pairs 3 degrees of freedom are left, so it can be told of these
        too.

        Args:
            fle_mm: rms length of one pair's localisation error.

        Raises:
            InputError: the error is not positive, or ``share`` is not between 0.5 and 1.
        """
        used = self.weights > 0.0
        most = largest_squares(self.moving[used], self.weights[used], fle_mm, share)
        return float((self.residuals_mm[used] ** 2).sum()) <= most

    def to_fixed(self, points: ArrayLike) -> Array:
        """Points of the moving frame, (m, 3) or (3,), in the fixed frame."""
        placed: Array = np.asarray(points, dtype=np.float64) @ self.transform[:3, :3].T + self.transform[:3, 3]
        return placed

    def to_moving(self, points: ArrayLike) -> Array:
        """Points of the fixed frame, (m, 3) or (3,), in the moving frame."""
        placed: Array = (np.asarray(points, dtype=np.float64) - self.transform[:3, 3]) @ self.transform[:3, :3]
        return placed

    def tre_covariance(self, points: ArrayLike, fle_mm: float, *, frame: Side = "moving") -> Array:
        """Covariances (m, 3, 3) in mm² of the registration's error at targets, to first order.

        Args:
            points: (m, 3) or (3,) targets in mm.
            fle_mm: rms length of one pair's localisation error, √3 times the standard deviation per axis; equal for all
                pairs and in all directions, that of both frames together.
            frame: in which the targets are given, and the axes of the covariances.

        Raises:
            InputError: the targets are no finite points, the error is negative, or no such frame.
        """
        targets = _targets(points)
        fle_mm = within("the localisation error fle_mm", fle_mm, 0.0)
        if frame not in _SIDES:
            raise InputError(f"targets are given in the frame 'moving' or 'fixed', not {frame!r:.40}")
        used = self.weights > 0.0
        centre, motion = pose_covariance((self.moving if frame == "moving" else self.fixed)[used], self.weights[used])
        rows = motion_rows(targets - centre)
        covariance: Array = (fle_mm**2 / 3.0) * (rows @ motion @ np.swapaxes(rows, 1, 2))
        return covariance

    def tre_mm(self, points: ArrayLike, fle_mm: float, *, frame: Side = "moving") -> Array:
        """Expected target registration error (m,): the rms length of the error at each target.

        Fitzpatrick, West & Maurer 1998: TRE² = FLE²/n (1 + ⅓ Σ d²/f²), with d the distance of the target from a
        principal axis of the points and f their rms distance from it. Arguments and errors as ``tre_covariance``.
        """
        squared: Array = np.trace(self.tre_covariance(points, fle_mm, frame=frame), axis1=1, axis2=2)
        return np.sqrt(squared)

    def tre_95_mm(self, points: ArrayLike, fle_mm: float, *, frame: Side = "moving", share: float = 0.95) -> Array:
        """Radii (m,) of balls about the targets that hold the error with a probability of 95 %, or ``share``.

        The quantile of the length of a normal error with the covariance of ``tre_covariance``, whose directions differ;
        arguments and errors as there.
        """
        return ball_radius(self.tre_covariance(points, fle_mm, frame=frame), share)


def register_points(fixed: ArrayLike, moving: ArrayLike, weights: ArrayLike | None = None) -> Registration:
    """The rigid transform from the moving to the fixed frame that fits pairs of points best.

    It minimises Σ w ‖fixed − (R moving + t)‖² over rotations R without mirror and translations t.

    Source: Arun, Huang & Blostein 1987 (by singular values), with a mirror excluded as in Umeyama 1991.

    Args:
        fixed, moving: (n, 3) in mm, n ≥ 3; row i of both is the same point.
        weights: (n,) not negative; a pair of weight 0 takes no part. None: all alike.

    Raises:
        InputError: fewer than three pairs take part, they lie on a line or coincide in one of the frames, numbers of
            points differ, or a number is not finite.
    """
    fixed, moving, weights = checked_pairs(fixed, moving, weights)
    rotation, translation = rigid_fits(fixed, moving, weights)
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, translation
    return Registration(transform, fixed, moving, weights)


def checked_points(what: str, points: ArrayLike, least: int = 0) -> Array:
    """A copy (n, 3) of finite points in mm.

    Raises:
        InputError: anything else, or fewer than ``least``.
    """
    given = real_array(what, points)
    if given.ndim != 2 or given.shape[1] != 3:
        raise InputError(f"{what} must be points (n, 3) in mm, not {given.shape}")
    bad = np.flatnonzero(~(np.abs(given) <= FARTHEST_MM).all(axis=1))
    if len(bad):
        raise InputError(f"point {bad[0] + 1} of {what} is not finite, or a kilometre away; give coordinates in mm")
    if len(given) < least:
        raise InputError(f"{len(given)} points of {what} are too few; at least {least} are needed")
    return given


def checked_pairs(fixed: ArrayLike, moving: ArrayLike, weights: ArrayLike | None) -> tuple[Array, Array, Array]:
    """Copies of what a fit needs: fixed (n, 3), moving (n, 3) and weights (n,); raises as ``register_points``."""
    first, second = checked_points("the fixed points", fixed, 3), checked_points("the moving points", moving, 3)
    if len(first) != len(second):
        raise InputError(
            f"{len(first)} fixed and {len(second)} moving points are no pairs; give both in the same order, or find "
            "the order with match_points"
        )
    share = np.ones(len(first)) if weights is None else real_array("the weights", weights)
    if share.shape != (len(first),) or not np.isfinite(share).all() or (share < 0.0).any():
        raise InputError(f"the weights must be {len(first)} finite numbers from 0 on, one for each pair")
    used = np.flatnonzero(share > 0.0)
    if len(used) < 3:
        raise InputError(f"only {len(used)} pairs have a positive weight; at least 3 are needed")
    for name, points in (("fixed", first), ("moving", second)):
        _check_spread(name, points[used], share[used] / share[used].max(), used)
    return first, second, share


def _check_spread(name: str, points: Array, weights: Array, numbers: NDArray[np.intp]) -> None:
    """Refuses points (n, 3) that leave a rotation free; ``numbers`` are theirs in what was given."""
    from scipy.spatial import cKDTree  # imported here: slow to load

    distance, nearest = cKDTree(points).query(points, k=2)  # of each point to itself, and to the nearest other one
    b = int(distance[:, 1].argmin())
    if distance[b, 1] < COINCIDENT_MM:
        a, b = sorted((b, int(nearest[b, 1]) if nearest[b, 1] != b else int(nearest[b, 0])))
        raise InputError(
            f"the {name} points {numbers[a] + 1} and {numbers[b] + 1} are in the same place; leave one of them out or "
            "measure it again"
        )
    about = points - weights @ points / weights.sum()
    spread = np.linalg.svd(np.sqrt(weights)[:, None] * about, compute_uv=False)
    if spread[1] < ON_A_LINE * spread[0]:
        raise InputError(
            f"the {name} points lie on a line, about which the rotation is not determined; add a point beside it"
        )


def _targets(points: ArrayLike) -> Array:
    given = real_array("the targets", points)
    return checked_points("the targets", given[None] if given.ndim == 1 else given)
