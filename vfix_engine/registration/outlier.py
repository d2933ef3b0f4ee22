"""Detection of an outlier among the pairs of a registration, by leaving out each in turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .expected_error import motion_rows
from .points import Registration, checked_pairs, register_points

Certainty = Literal["outlier", "suspect"]

OUTLIER_MM = 2.0  # a pair with a smaller error is identified correctly in only two of three cases: a suspect
OUTLIER_OF_FOUR_MM = 3.0  # the same for four pairs, of which only three remain

_BY_CHANCE = 0.2  # probability of reporting a pair although all are good
_FAR_MM, _FAR_BY_CHANCE = 1.5, 0.1  # a pair with a larger error is reported at this probability of its own
_EXACT_MM = 1e-6  # smaller residuals are rounding


@dataclass(frozen=True, eq=False)
class Outlier:
    """The pair that fits the others worst.

    index: of the pair. certainty: 'outlier' if its error is 2 mm or more (3 mm with four pairs), else 'suspect'.
    off_mm: distance of its points after the fit of the others. fre_mm: with it. without: the fit of the others.
    """

    index: int
    certainty: Certainty
    off_mm: float
    fre_mm: float
    without: Registration


def find_outlier(fixed: ArrayLike, moving: ArrayLike, weights: ArrayLike | None = None) -> Outlier | None:
    """Return the pair whose omission reduces FRE most, if significant; None if none is or with fewer than four pairs.

    With e the distance vector of the omitted pair and S its covariance over σ², from its own error and that of the fit
    of the others, eᵀS⁻¹e / 3 over their mean square residual is F-distributed with 3 and 3 (n − 1) − 6 degrees of
    freedom. A pair is reported if the probability of that is below 0.2 / n, or below 0.1 if its error is 1.5 mm or
    more. So about one good set in four or five has a suspect.

    With σ = 0.3 mm per axis a pair with an error of 2 mm is the one whose omission reduces FRE most in 83 % of cases of
    4 pairs, 95 % of 5 and 97 % of 6, with an error of 5 mm in 98 to 100 %, and of 1 mm in only 56 to 68 %.

    Args:
        fixed, moving, weights: as for ``register_points``; the weights are inverse to the pairs' variances.

    Raises:
        InputError: as ``register_points``.
    """
    fixed, moving, weights = checked_pairs(fixed, moving, weights)
    whole = register_points(fixed, moving, weights)
    used = np.flatnonzero(weights > 0.0)
    if len(used) < 4 or whole.fre_mm < _EXACT_MM:
        return None
    fits: list[tuple[float, int, Registration]] = []
    for index in used.tolist():
        others = weights.copy()
        others[index] = 0.0
        try:
            fit = register_points(fixed, moving, others)
        except InputError:  # the others are collinear
            continue
        fits.append((float(others @ fit.residuals_mm**2), index, fit))
    if not fits:
        return None
    squares, index, fit = min(fits, key=lambda one: one[0])
    off = float(fit.residuals_mm[index])
    chance = _chance(fit, index, squares, float(weights[index]))
    if chance >= _BY_CHANCE / len(used) and (chance >= _FAR_BY_CHANCE or off < _FAR_MM):
        return None
    surely = OUTLIER_OF_FOUR_MM if len(used) == 4 else OUTLIER_MM
    return Outlier(index, "outlier" if off >= surely else "suspect", off, whole.fre_mm, fit)


def _chance(fit: Registration, index: int, squares: float, weight: float) -> float:
    """Probability of an error at least this large if the pair were as good as the others."""
    from scipy.special import fdtrc  # imported here: slow to load

    used = fit.weights > 0.0
    share, points = fit.weights[used], fit.moving[used]
    centre = share @ points / share.sum()
    rows = motion_rows(points - centre)
    motion = np.linalg.inv(np.einsum("n,nij,nik->jk", share, rows, rows))
    row = motion_rows(fit.moving[index][None] - centre)[0]
    error = (fit.fixed[index] - fit.to_fixed(fit.moving[index])) @ fit.transform[:3, :3]
    freedom = 3 * int(used.sum()) - 6
    spread = np.eye(3) / weight + row @ motion @ row.T
    squares = max(squares, float(share.max()) * _EXACT_MM**2)
    return float(fdtrc(3, freedom, error @ np.linalg.solve(spread, error) / 3.0 / (squares / freedom)))
