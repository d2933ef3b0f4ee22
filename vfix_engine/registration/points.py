"""Registration by pairs of points: the rigid transform, residuals at the pairs, and the error elsewhere."""

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

COINCIDENT_MM = 0.01  # points closer than this coincide
ON_A_LINE = 0.01  # ratio of the points' spread perpendicular to a line and along it, below which they are collinear
_SIDES = ("moving", "fixed")


@dataclass(frozen=True, eq=False)
class Registration:
    """Rigid transform that fits pairs of points, in mm. Arrays are read-only.

    FRE measures the fit of the pairs, not the error at a target: the two are statistically independent, and with more
    points FRE grows while TRE decreases. For a target use ``tre_mm``.

    transform: (4, 4), maps a point of the moving frame to the fixed frame.
    fixed, moving: (n, 3) the pairs, each in its frame.
    weights: (n,) of the pairs' squared residuals; those of weight 0 are excluded.

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
        """Distance (n,) of each fixed point from its transformed moving point, including pairs with weight 0."""
        lengths = residual_lengths(self.fixed, self.moving, self.transform[:3, :3], self.transform[:3, 3])
        lengths.setflags(write=False)
        return lengths

    @property
    def count(self) -> int:
        """Number of pairs with a positive weight."""
        return int(np.count_nonzero(self.weights))

    @property
    def fre_mm(self) -> float:
        """Fiducial registration error: rms of the residuals over the pairs with positive weight.

        It is unweighted: each of these pairs counts equally.
        """
        return float(np.sqrt((self.residuals_mm[self.weights > 0.0] ** 2).mean()))

    @property
    def mean_residual_mm(self) -> float:
        """Mean of the residuals' lengths over the pairs with positive weight; at most ``fre_mm``."""
        return float(self.residuals_mm[self.weights > 0.0].mean())

    @property
    def fle_mm(self) -> float:
        """Rms localisation error (length) that explains ``fre_mm``: FRE / √(1 − 2/n) with equal weights.

        For other weights 1 − 2/n is replaced by the exact expectation of that fit. Three pairs leave three degrees of
        freedom (3n − 6), so there is always an estimate; it is rough, with a relative standard deviation of about
        1/√(2 (3n − 6)): 41 % for 3 pairs and 24 % for 5.
        """
        used = self.weights > 0.0
        return self.fre_mm / float(np.sqrt(residual_share(self.moving[used], self.weights[used])))

    def explained_by(self, fle_mm: float, share: float = 0.999) -> bool:
        """Whether residuals of this size are expected for pairs with that localisation error.

        False if fewer than 1 − ``share`` of such fits would have residuals as large: then the error is larger than
        stated, or the pairs do not correspond. Three pairs leave 3 degrees of freedom, so the test applies to them too.

        Args:
            fle_mm: rms length of one pair's localisation error.

        Raises:
            InputError: the error is not positive, or ``share`` is not between 0.5 and 1.
        """
        used = self.weights > 0.0
        most = largest_squares(self.moving[used], self.weights[used], fle_mm, share)
        return float((self.residuals_mm[used] ** 2).sum()) <= most

    def to_fixed(self, points: ArrayLike) -> Array:
        """Transform points of the moving frame, (m, 3) or (3,), to the fixed frame."""
        placed: Array = np.asarray(points, dtype=np.float64) @ self.transform[:3, :3].T + self.transform[:3, 3]
        return placed

    def to_moving(self, points: ArrayLike) -> Array:
        """Transform points of the fixed frame, (m, 3) or (3,), to the moving frame."""
        placed: Array = (np.asarray(points, dtype=np.float64) - self.transform[:3, 3]) @ self.transform[:3, :3]
        return placed

    def tre_covariance(self, points: ArrayLike, fle_mm: float, *, frame: Side = "moving") -> Array:
        """Covariances (m, 3, 3) in mm² of the registration's error at targets, to first order.

        Args:
            points: (m, 3) or (3,) targets in mm.
            fle_mm: rms length of one pair's localisation error, √3 times the standard deviation per axis; equal for all
                pairs and isotropic, for both frames together.
            frame: of the targets, and of the axes of the covariances.

        Raises:
            InputError: the targets are not finite points, the error is negative, or the frame is unknown.
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
        """Radii (m,) of balls about the targets that contain the error with a probability of 95 %, or ``share``.

        The quantile of the length of a normal error with the anisotropic covariance of ``tre_covariance``; arguments
        and errors as there.
        """
        return ball_radius(self.tre_covariance(points, fle_mm, frame=frame), share)


def register_points(fixed: ArrayLike, moving: ArrayLike, weights: ArrayLike | None = None) -> Registration:
    """Compute the rigid transform from the moving to the fixed frame that fits pairs of points best.

    It minimises Σ w ‖fixed − (R moving + t)‖² over proper rotations R and translations t.

    Source: Arun, Huang & Blostein 1987 (by singular values), with reflections excluded as in Umeyama 1991.

    Args:
        fixed, moving: (n, 3) in mm, n ≥ 3; row i of both is the same point.
        weights: (n,) ≥ 0; a pair of weight 0 is excluded. None: all equal.

    Raises:
        InputError: fewer than three pairs are used, they are collinear or coincide in one of the frames, the numbers
            of points differ, or a number is not finite.
    """
    fixed, moving, weights = checked_pairs(fixed, moving, weights)
    rotation, translation = rigid_fits(fixed, moving, weights)
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = rotation, translation
    return Registration(transform, fixed, moving, weights)


def checked_points(what: str, points: ArrayLike, least: int = 0) -> Array:
    """Return a copy (n, 3) of finite points in mm.

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
    """Return copies of fixed (n, 3), moving (n, 3) and weights (n,), validated; raises as ``register_points``."""
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
    """Refuse points (n, 3) that do not determine the rotation; ``numbers`` are their indices in the arguments."""
    from scipy.spatial import cKDTree  # imported here: slow to load

    distance, nearest = cKDTree(points).query(points, k=2)  # each point itself, and its nearest neighbour
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
