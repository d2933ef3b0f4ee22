"""A quadratic program in numbers, and its solution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import ControlError
from .problem_kernel import set_box

RETREAT = 100.0  # cost of each mm² by which a retreat is missed, relative to the wanted step


class Solution(NamedTuple):
    """Solution of a program: step Δq (n,) in mm and rad, progress λ, and the multipliers of all unknowns and rows.

    why: reason for the lack of a solution; '' if the solution fulfils the Karush-Kuhn-Tucker conditions.
    """

    step: Array
    progress: float
    multiplier: Array
    unknowns: int
    why: str = ""

    @property
    def found(self) -> bool:
        """Whether there is a (checked) solution."""
        return not self.why

    @property
    def dq(self) -> Array:
        """The step Δq (n,) in mm and rad.

        Raises:
            ControlError: there is no solution; the message gives the reason.
        """
        if self.why:
            raise ControlError(f"the step has no solution: {self.why}")
        return self.step

    @property
    def row_multiplier(self) -> Array:
        """Multipliers of the constraint rows (m,)."""
        return self.multiplier[self.unknowns :]

    @property
    def bound_multiplier(self) -> Array:
        """Multipliers of the joints' bounds (n,), positive at the upper one."""
        return self.multiplier[: len(self.step)]


class Program(NamedTuple):
    """One scaled QP over y = (Δq / L, λ, slacks / L), c unknowns and m rows; ``scale`` L in mm, ``joints`` n.

    hessian: (c, c); gradient: (c,); rows: (m, c).
    upper, lower: (c + m,) bounds of the unknowns, then of the rows.
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
        """Right-hand side h (m,)."""
        return self.upper[len(self.gradient) :]

    @property
    def low(self) -> Array:
        """Lower bounds of the unknowns (c,)."""
        return self.lower[: len(self.gradient)]

    @property
    def high(self) -> Array:
        """Upper bounds of the unknowns (c,)."""
        return self.upper[: len(self.gradient)]

    @property
    def row_count(self) -> int:
        """Number of inequality rows as the papers count them: constraints and both bounds of every joint."""
        return len(self.rows) + 2 * self.joints

    def holdable(self, first: int = 0) -> Program:
        """Return the same problem with bounds widened from row ``first`` on until x = 0 is feasible.

        What the widened rows required, such as a retreat from both walls of a gap, becomes an objective of high weight.
        """
        upper = self.upper.copy()
        bound = upper[len(self.gradient) :]
        asked = (bound < 0.0) & (np.arange(len(bound)) >= first)
        asked &= ~self.rows[:, self.joints + 1 :].any(axis=1)  # a soft row never makes the problem infeasible
        rows, target = self.rows[asked], bound[asked]
        bound[asked] = 0.0
        # If squaring a row overflows, the solution fails its check like any other.
        with np.errstate(over="ignore", invalid="ignore"):
            hessian = self.hessian + RETREAT * (rows.T @ rows)
            gradient = self.gradient - RETREAT * (target @ rows)
        return self._replace(hessian=hessian, gradient=gradient, upper=upper)

    def boxed(self, low: Array, high: Array) -> Program:
        """Return the same problem with other bounds (n,), (n,) of Δq."""
        upper, lower = self.upper.copy(), self.lower.copy()
        set_box(low, high, self.scale, upper, lower)
        return self._replace(upper=upper, lower=lower)
