"""Which pair of a registration is off: each is left out in turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .expected_error import motion_rows
from .points import Registration, checked_pairs, register_points

Certainty = Literal["outlier", "suspect"]

OUTLIER_MM = 2.0  # a pair that is off by less is named rightly in two of three cases only: a suspect
OUTLIER_OF_FOUR_MM = 3.0  # the same for four pairs, where three are left to judge by

_BY_CHANCE = 0.2  # probability of naming one of pairs that are all good
_FAR_MM, _FAR_BY_CHANCE = 1.5, 0.1  # a pair that is off by more may be named at this probability of its own
_EXACT_MM = 1e-6  # residuals below that are rounding


@dataclass(frozen=True, eq=False)
class Outlier:
    """The pair that fits the others worst.

    index: of the pair. certainty: 'outlier' where it is off by 2 mm or more (3 mm of four pairs), else 'suspect'.
    off_mm: distance of its points after the fit of the others. fre_mm: with it. without: the fit of the others.
    """

    index: int
    certainty: Certainty
    off_mm: float
    fre_mm: float
    without: Registration


def find_outlier(fixed: ArrayLike, moving: ArrayLike, weights: ArrayLike | None = None) -> Outlier | None:
    """The pair whose omission lowers FRE most, where it stands out; None where none does or fewer than four take part.

    With e the distance vector of the pair left out and S its covariance over σ², by its own error and by that of the
    fit of the others, eᵀS⁻¹e / 3 over their mean square residual is F-distributed with 3 and 3 (n − 1) − 6 degrees of
    freedom. A pair stands out where that is improbable: by 0.2 / n, or by 0.1 if it is off by 1.5 mm or more. So about
    one good set in four or five has a suspect.

    With σ = 0.3 mm per axis the pair that is off by 2 mm is the one whose omission lowers FRE most in 83 % of cases of
    4 pairs, 95 % of 5 and 97 % of 6, one off by 5 mm in 98 to 100 %, and one off by 1 mm in 56 to 68 % only.

    Args:
        fixed, moving, weights: as of ``register_points``; the weights are inverse to the pairs' variances.

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
        except InputError:  # the others lie on a line
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
    """Probability of a pair this far off or farther, if it were as good as the others."""
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
