"""Expected errors of a registration by point pairs.

FLE, the fiducial localisation error, is the length of the measurement error of one point; if points are measured in
both frames it is that of the difference. FRE, the fiducial registration error, is the residual at the points after the
fit; TRE, the target registration error, is the error elsewhere. Every value here is a root mean square (rms) of lengths
in mm, for independent and isotropic errors: with a standard deviation of σ per axis FLE is √3 σ.

Source: Fitzpatrick, West & Maurer 1998, *Predicting error in rigid-body point-based registration*.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from ..validate import positive, whole, within

_POLAR, _AROUND = 48, 24  # nodes of the integral over directions: 1e-7 of the radius or better


def expected_fre_mm(n: int, fle_mm: float) -> float:
    """Expected rms FRE of n points fitted with equal weights: FLE √(1 − 2/n).

    Raises:
        InputError: fewer than 3 points, or a negative error.
    """
    count = whole("the number of points", n, 3)
    return within("the localisation error fle_mm", fle_mm, 0.0) * math.sqrt(1.0 - 2.0 / count)


def fle_from_fre_mm(n: int, fre_mm: float) -> float:
    """The rms FLE that explains an rms FRE of n points with equal weights: FRE / √(1 − 2/n).

    From a single fit the estimate is rough: its relative standard deviation is about 1/√(2 (3n − 6)), 41 % for 3 points
    and 24 % for 5.

    Raises:
        InputError: fewer than 3 points, or a negative error.
    """
    count = whole("the number of points", n, 3)
    return within("the registration error fre_mm", fre_mm, 0.0) / math.sqrt(1.0 - 2.0 / count)


def pose_covariance(points: Array, weights: Array) -> tuple[Array, Array]:
    """Centre (3,) and covariance (6, 6) of the fitted motion for σ = 1 per axis, to first order.

    The motion is (t, ω): a point p moves by t + ω × (p − centre). All points have the same error, whatever their
    weights; with M = Σ w AᵀA and A = [I, −[q]×] the fit is M⁻¹ Σ w Aᵀ e, and its covariance M⁻¹ (Σ w² AᵀA) M⁻¹.

    Args:
        points: (n, 3) mm, not on a line.
        weights: (n,), of the fit.
    """
    weights = weights / weights.max()
    centre = weights @ points / weights.sum()
    rows = motion_rows(points - centre)
    back = np.linalg.inv(np.einsum("n,nij,nik->jk", weights, rows, rows))
    covariance: Array = back @ np.einsum("n,nij,nik->jk", weights**2, rows, rows) @ back
    return centre, covariance


def residual_share(points: Array, weights: Array) -> float:
    """Expected mean square residual of the points divided by FLE²: 1 − 2/n with equal weights."""
    squares = _residual_squares(points, weights)
    return float(squares.trace() / len(squares))


def largest_squares(points: Array, weights: Array, fle_mm: float, share: float = 0.999) -> float:
    """Quantile ``share`` of the sum of squared residuals, mm², of points with the localisation error ``fle_mm``.

    With equal weights the sum is σ² χ² with 3n − 6 degrees of freedom and σ² = FLE²/3. Otherwise it is a weighted sum
    of χ² with one degree each, approximated by a scaled χ² with the same mean and variance (Satterthwaite 1946).

    Args:
        points: (n, 3) mm, not on a line.
        weights: (n,), of the fit.

    Raises:
        InputError: the error is not positive, or ``share`` is not between 0.5 and 1.
    """
    from scipy.special import chdtri  # imported here: slow to load

    share = within("the share of fits", share, 0.5, 1.0 - 1e-9)
    squares = _residual_squares(points, weights)
    mean, half_variance = float(squares.trace()), float((squares**2).sum())
    freedom = mean**2 / half_variance
    return sigma_per_axis(fle_mm) ** 2 * (half_variance / mean) * float(chdtri(freedom, 1.0 - share))


def _residual_squares(points: Array, weights: Array) -> Array:
    """Matrix S (3n, 3n) of the quadratic form eᵀ S e, the sum of squared residuals for errors e of the points."""
    weights = weights / weights.max()
    rows = motion_rows(points - weights @ points / weights.sum())
    back = np.linalg.inv(np.einsum("n,nij,nik->jk", weights, rows, rows))
    stacked = rows.reshape(-1, 6)
    left = np.eye(len(stacked)) - stacked @ back @ (stacked * np.repeat(weights, 3)[:, None]).T
    squares: Array = left.T @ left
    return squares


def motion_rows(offsets: Array) -> Array:
    """Matrices (n, 3, 6) that map a small motion (t, ω) to the displacement t + ω × d of offsets d (n, 3)."""
    rows = np.zeros((len(offsets), 3, 6))
    rows[:, :, :3] = np.eye(3)
    x, y, z = offsets.T
    rows[:, 0, 4], rows[:, 0, 5] = z, -y
    rows[:, 1, 3], rows[:, 1, 5] = -z, x
    rows[:, 2, 3], rows[:, 2, 4] = y, -x
    return rows


def ball_radius(covariances: Array, share: float = 0.95) -> Array:
    """Radii (m,) of balls about 0 that contain normal errors of covariances (m, 3, 3) with the probability ``share``.

    With z normal and u its direction, ‖e‖² = ‖z‖² a(u) where a(u) = Σ λ u² with the eigenvalues λ, so the probability
    is the mean over all directions of χ²₃ at r² / a(u). It is integrated over the sphere and solved for r by Newton's
    method, which converges monotonically: the function is concave from the quantile of the longest axis on.

    Raises:
        InputError: ``share`` is not from 0.7 to 1 (excluded).
    """
    from scipy.special import chdtr, chdtri  # imported here: slow to load

    share = within("the share of errors in the ball", share, 0.7, 1.0 - 1e-9)
    eigenvalues = np.clip(np.linalg.eigvalsh(covariances), 0.0, None)
    largest = eigenvalues[:, 2]
    relative = np.where(largest[:, None] > 0.0, eigenvalues, 1.0) / np.where(largest > 0.0, largest, 1.0)[:, None]
    cosine, weights = np.polynomial.legendre.leggauss(_POLAR)
    cosine, weights = 0.5 * (cosine + 1.0), np.repeat(0.5 * weights, _AROUND) / _AROUND  # one octant, by symmetry
    around = (np.arange(_AROUND) + 0.5) * (0.5 * np.pi / _AROUND)
    squares = np.stack(
        [
            np.outer(1.0 - cosine**2, np.cos(around) ** 2).ravel(),
            np.outer(1.0 - cosine**2, np.sin(around) ** 2).ravel(),
            np.repeat(cosine**2, _AROUND),
        ]
    )
    spread = np.maximum(relative @ squares, 1e-12)
    squared = np.full(len(largest), float(chdtri(1, 1.0 - share)))
    for _ in range(30):
        x = squared[:, None] / spread
        density = np.sqrt(x / (2.0 * np.pi)) * np.exp(-0.5 * x) / spread
        step = (share - chdtr(3, x) @ weights) / (density @ weights)
        squared = squared + step
        if not (np.abs(step) > 1e-12 * squared).any():
            break
    radii: Array = np.sqrt(squared * largest)
    return radii


def estimated_factor(n: int, share: float = 0.95) -> float:
    """Factor by which a ball is larger if FLE is not known but estimated from the residuals of n pairs.

    The squared error over the estimated variance follows F with 3 and 3n − 6 degrees of freedom instead of χ² with 3,
    for an isotropic error: 1.9 for three pairs, 1.2 for five, and 1 for many.

    Raises:
        InputError: fewer than 3 points, or ``share`` is not between 0.5 and 1.
    """
    from scipy.special import chdtri, fdtri  # imported here: slow to load

    share = within("the share of errors in the ball", share, 0.5, 1.0 - 1e-9)
    freedom = 3 * whole("the number of points", n, 3) - 6
    return math.sqrt(3.0 * float(fdtri(3, freedom, share)) / float(chdtri(3, 1.0 - share)))


def sigma_per_axis(fle_mm: float) -> float:
    """Standard deviation per axis of an isotropic error whose rms length is ``fle_mm``: FLE / √3.

    Raises:
        InputError: the error is not positive.
    """
    return positive("the localisation error fle_mm", fle_mm) / math.sqrt(3.0)
