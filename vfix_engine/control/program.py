"""A quadratic program as numbers, and its answer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import ControlError
from .problem_kernel import set_box

RETREAT = 100.0  # what a missing mm² of a retreat costs where not all of it can be had, against one of the wanted step


class Solution(NamedTuple):
    """The answer to a program: step Δq (n,) in mm and rad, progress λ, and the multipliers of all unknowns and rows.

    why: why there is none; '' where the answer fulfils the Karush-Kuhn-Tucker conditions.
    """

    step: Array
    progress: float
    multiplier: Array
    unknowns: int
    why: str = ""

    @property
    def found(self) -> bool:
        """Whether there is an answer; it has been checked then."""
        return not self.why

    @property
    def dq(self) -> Array:
        """The step Δq (n,) in mm and rad.

        Raises:
            ControlError: there is no answer; the message says why.
        """
        if self.why:
            raise ControlError(f"the step has no solution: {self.why}")
        return self.step

    @property
    def row_multiplier(self) -> Array:
        """Of every constraint row (m,)."""
        return self.multiplier[self.unknowns :]

    @property
    def bound_multiplier(self) -> Array:
        """Of every joint's limits (n,), positive at the upper one."""
        return self.multiplier[: len(self.step)]


class Program(NamedTuple):
    """One scaled QP over y = (Δq / L, λ, slacks / L), c unknowns and m rows; ``scale`` L in mm, ``joints`` n.

    hessian: (c, c); gradient: (c,); rows: (m, c).
    upper, lower: (c + m,) limits of the unknowns, then of the rows.
    """

    hessian: Array
    gradient: Array
    rows: Array
    upper: Array
    lower: Array
    scale: float
    joints: int

    @property
    def bound(self) -> Array:
        """h (m,)."""
        return self.upper[len(self.gradient) :]

    @property
    def low(self) -> Array:
        """Least value of every unknown (c,)."""
        return self.lower[: len(self.gradient)]

    @property
    def high(self) -> Array:
        """Largest value of every unknown (c,)."""
        return self.upper[: len(self.gradient)]

    @property
    def row_count(self) -> int:
        """Inequality rows the way the papers count them: constraints and both sides of every joint bound."""
        return len(self.rows) + 2 * self.joints

    def holdable(self, first: int = 0) -> Program:
        """The same problem with every bound widened so far that x = 0 is feasible, from row ``first`` on.

        What the widened rows asked for, such as a retreat from both walls of a gap, is a strong wish from then on.
        """
        upper = self.upper.copy()
        bound = upper[len(self.gradient) :]
        asked = (bound < 0.0) & (np.arange(len(bound)) >= first)
        asked &= ~self.rows[:, self.joints + 1 :].any(axis=1)  # a soft row is never in the way
        rows, target = self.rows[asked], bound[asked]
        bound[asked] = 0.0
        # A row too large to be squared makes a problem whose answer does not pass the check, as anywhere else.
        with np.errstate(over="ignore", invalid="ignore"):
            hessian = self.hessian + RETREAT * (rows.T @ rows)
            gradient = self.gradient - RETREAT * (target @ rows)
        return self._replace(hessian=hessian, gradient=gradient, upper=upper)

    def boxed(self, low: Array, high: Array) -> Program:
        """The same problem with another box (n,), (n,) for Δq."""
        upper, lower = self.upper.copy(), self.lower.copy()
        set_box(low, high, self.scale, upper, lower)
        return self._replace(upper=upper, lower=lower)
