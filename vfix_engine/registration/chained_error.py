"""The error to expect where a registration's points were measured in one frame and taken to another.

Errors of independent sources add as covariances: that of the fit, by the layout of its points, and that of what lies
between, such as a tracker beside a robot, whose place moves all points alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..validate import real_array, within
from .expected_error import ball_radius, estimated_factor, motion_rows
from .points import Registration, checked_points


def target_errors_mm(
    registration: Registration,
    points: ArrayLike,
    fle_mm: float | None = None,
    *,
    motion_covariance: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """The error to be expected of a registration at targets: its rms length, and the radius of 95 %.

    Args:
        points: (m, 3) targets in mm, in the moving frame.
        fle_mm: rms length of one pair's localisation error as stated. None: estimated from the fit; the ball of the
            fit is larger then by ``estimated_factor``.
        motion_covariance: (6, 6) of a motion (t, ω) of the whole fixed frame, in mm and rad, that is unknown and
            independent of the fit: a point p of it is off by t + ω × p, as ``HandEye.covariance``. None: there is none.

    Returns:
        Rms lengths (m,), and radii (m,) of balls about the targets, in mm.

    Raises:
        InputError: the targets are no finite points, the error is negative, or the covariance is none.
    """
    of_fit, between = target_covariances(registration, points, fle_mm, motion_covariance=motion_covariance)
    factor = estimated_factor(registration.count) if fle_mm is None else 1.0
    rms: Array = np.sqrt(np.trace(of_fit + between, axis1=1, axis2=2))
    return rms, ball_radius(factor**2 * of_fit + between)


def target_covariances(
    registration: Registration,
    points: ArrayLike,
    fle_mm: float | None = None,
    *,
    motion_covariance: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Covariances (m, 3, 3) of the error at targets, in mm² and the fixed frame's axes: of the fit, and of the motion.

    The two are independent, so that their sum is that of the whole error. Arguments and errors as ``target_errors_mm``.
    """
    given = checked_points("the targets", points)
    targets, turn = registration.to_fixed(given), registration.transform[:3, :3]
    fle = registration.fle_mm if fle_mm is None else within("the localisation error fle_mm", fle_mm, 0.0)
    of_fit: Array = turn @ registration.tre_covariance(given, fle) @ turn.T
    if motion_covariance is None:
        return of_fit, np.zeros_like(of_fit)
    rows = motion_rows(targets)
    between: Array = rows @ checked_covariance(motion_covariance) @ np.swapaxes(rows, 1, 2)
    return of_fit, between


def checked_covariance(covariance: ArrayLike) -> Array:
    """A copy (6, 6) of the covariance of a motion.

    Raises:
        InputError: another shape, numbers that are not finite, not symmetric, or negative in a direction.
    """
    given = real_array("the covariance of the motion", covariance)
    scale = float(np.abs(given).max(initial=0.0))
    if given.shape != (6, 6) or not np.isfinite(scale) or np.abs(given - given.T).max() > 1e-9 * scale:
        raise InputError("the covariance of the motion must be symmetric and finite, (6, 6) in mm and rad")
    if np.linalg.eigvalsh(given).min() < -1e-9 * scale:
        raise InputError("the covariance of the motion is negative in a direction; give one of errors")
    return given
