"""The polar Hermite surface through control bends: Kwok 2013, eq. 21-23 and 27, with second derivatives for (30)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError
from .hermite_kernel import hermite_cartesian, hermite_polar

R_MAX = 1.4  # Kwok 2013, section IV.B: bends beyond the control bends, so that the hand feels the wall


class PolarHermite:
    """Q(r, ϑ): joints of the distal links as a function of the size r and the direction ϑ in rad of their bend.

    Q(0, ϑ) is the rest and Q(1, ϑ_i) the control configuration i. In ϑ it is a periodic cubic Hermite spline with the
    slopes (q_{i+1} − q_{i−1})/(ϑ_{i+1} − ϑ_{i−1}), in r a cubic whose slope at 0 is half the difference across the
    diameter and at 1 the difference from the rest. Beyond r = 1 it is linear, and Q(−r, ϑ) = Q(r, ϑ + π).

    It is continuously differentiable in ϑ and along every line through r = 0, twice within the intervals; not in every
    direction at r = 0, where the slope ½(Θ(ϑ) − Θ(ϑ + π)) need not be linear in (cos ϑ, sin ϑ). Joint limits are left
    to
    the caller: Q between and beyond control configurations within limits may go beyond them.

    Args:
        q_nominal: (n,) rad.
        angles: (c,) ϑ_i, rad, c ≥ 3, increasing, all within one turn from the first.
        configurations: (c, n) rad, q(1, ϑ_i).
        r_max: upper limit of r, stored for the caller.

    Raises:
        InputError: shapes that do not fit, numbers that are not finite, angles that do not increase within one turn, or
            an r_max below 1.
    """

    def __init__(
        self, q_nominal: ArrayLike, angles: ArrayLike, configurations: ArrayLike, r_max: float = R_MAX
    ) -> None:
        rest, knots = np.array(q_nominal, dtype=np.float64), np.array(angles, dtype=np.float64)
        shapes = np.array(configurations, dtype=np.float64, order="C")
        if rest.ndim != 1 or knots.ndim != 1 or shapes.shape != (len(knots), len(rest)):
            raise InputError(f"{knots.shape} control angles and {rest.shape} joints do not fit to {shapes.shape} bends")
        if not (np.isfinite(rest).all() and np.isfinite(knots).all() and np.isfinite(shapes).all()):
            raise InputError("control bends and their angles are finite numbers")
        turn = 2.0 * math.pi
        if len(knots) < 3 or np.diff(knots).min() <= 0.0 or knots[-1] - knots[0] >= turn:
            raise InputError(f"control angles are at least 3, increasing, within one turn: not {knots}")
        if not (math.isfinite(r_max) and r_max >= 1.0):
            raise InputError(f"bends go to r_max = 1 at least, not {r_max}")
        self.q_nominal, self.angles, self.configurations, self.r_max = rest, knots, shapes, float(r_max)
        self.coefficients = _coefficients(knots, shapes)
        for array in (rest, knots, shapes, self.coefficients):
            array.setflags(write=False)

    def value(self, r: float, theta: float) -> Array:
        """Q(r, ϑ) (n,) in rad (23)."""
        value: Array = self._polar(r, theta)[0]
        return value

    def partials(self, r: float, theta: float) -> Array:
        """∇Q = [Q_r, Q_ϑ] (n, 2) in rad (27)."""
        return self._polar(r, theta)[1:3].T

    def second(self, r: float, theta: float) -> Array:
        """Q_rr, Q_rϑ and Q_ϑϑ (n, 3) in rad, for (30); at a control angle those of the interval after it."""
        return self._polar(r, theta)[3:].T

    def cartesian(self, u: float, v: float) -> tuple[Array, Array]:
        """Q (n,) at (u, v) = r (cos ϑ, sin ϑ) and its partial derivatives (n, 2) with u and v, finite at (0, 0) too.

        Raises:
            InputError: numbers that are not finite; of ``value``, ``partials`` and ``second`` too.
        """
        _check_place(u, v)
        out = np.empty((3, len(self.q_nominal)))
        hermite_cartesian(self.angles, self.coefficients, self.q_nominal, float(u), float(v), out)
        return out[0], out[1:].T

    def _polar(self, r: float, theta: float) -> Array:
        _check_place(r, theta)
        out = np.empty((6, len(self.q_nominal)))
        hermite_polar(self.angles, self.coefficients, self.q_nominal, float(r), float(theta), out)
        return out


def _check_place(one: float, two: float) -> None:
    if not (math.isfinite(one) and math.isfinite(two)):
        raise InputError(f"a surface of bends has no place ({one}, {two})")


def _coefficients(knots: Array, shapes: Array) -> Array:
    """Θ of (22) on every interval as a cubic (c, 4, n) in ϑ − ϑ_i."""
    turn = 2.0 * math.pi
    ahead, behind = np.roll(knots, -1), np.roll(knots, 1)
    ahead[-1] += turn  # ϑ_{n+1} = ϑ_1 + 2π
    behind[0] -= turn
    width = (ahead - knots)[:, None]
    after, before = np.roll(shapes, -1, axis=0), np.roll(shapes, 1, axis=0)
    slope = (after - before) / (ahead - behind)[:, None]  # (22), with the ½ that the print leaves out
    slope_after = np.roll(slope, -1, axis=0)
    rise = (after - shapes) / width
    second = (3.0 * rise - 2.0 * slope - slope_after) / width
    third = (slope + slope_after - 2.0 * rise) / width**2
    return np.ascontiguousarray(np.stack([shapes, slope, second, third], axis=1))
