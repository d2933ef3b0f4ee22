"""Expected error of a registration whose points were measured in one frame and transformed to another.

Errors of independent sources add as covariances: that of the fit, by the layout of its points, and that of the
transform between the frames, such as the pose of a tracker beside a robot, which moves all points rigidly.
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
    """Expected error of a registration at targets: its rms length, and the radius of the 95 % ball.

    Args:
        points: (m, 3) targets in mm, in the moving frame.
        fle_mm: rms length of one pair's localisation error, if known. None: estimated from the fit; the ball of the
            fit is then larger by ``estimated_factor``.
        motion_covariance: (6, 6) of an unknown motion (t, ω) of the whole fixed frame, in mm and rad, independent of
            the fit: a point p of it is displaced by t + ω × p, as in ``HandEye.covariance``. None: there is none.

    Returns:
        Rms lengths (m,), and radii (m,) of balls about the targets, in mm.

    Raises:
        InputError: the targets are not finite points, the error is negative, or the covariance is invalid.
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

    The two are independent, so the total covariance is their sum. Arguments and errors as ``target_errors_mm``.
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
    """Return a copy (6, 6) of the covariance of a motion.

    Raises:
        InputError: the shape is wrong, numbers are not finite, or the matrix is not symmetric positive semidefinite.
    """
    given = real_array("the covariance of the motion", covariance)
    scale = float(np.abs(given).max(initial=0.0))
    if given.shape != (6, 6) or not np.isfinite(scale) or np.abs(given - given.T).max() > 1e-9 * scale:
        raise InputError("the covariance of the motion must be symmetric and finite, (6, 6) in mm and rad")
    if np.linalg.eigvalsh(given).min() < -1e-9 * scale:
        raise InputError("the covariance of the motion is negative in a direction; give one of errors")
    return given
