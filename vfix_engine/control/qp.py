"""All objectives and constraints stacked to one QP, solved, and the answer checked (Li 2007, eq. 20-21).

Problem: minimise ½ xᵀH x + fᵀx subject to G x ≤ h and low ≤ x ≤ high, x = (Δq, λ, slacks of soft constraints).
The step is scaled by its length L before solving, so that tolerances mean the same at every speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import daqp
import numpy as np
import qpsolvers
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from ..errors import ControlError
from ..fixtures import Constraint, Objective

Array = NDArray[np.float64]

_UNBOUNDED = 1e30
_REGULARISATION = 1e-9  # keeps H positive definite where an objective says nothing, e.g. about λ
PRIMAL_TOLERANCE = 1e-6  # of a row, in units of the step's length
# What a solver is asked for so that its answer stands the check: by default a first-order one stops too early.
_ACCURACY: dict[str, dict[str, Any]] = {"osqp": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20_000}}
DUAL_TOLERANCE = 1e-5  # of the stationarity residual, in units of the objective's gradient


@dataclass(frozen=True)
class Solution:
    """A checked answer: step Δq (n,), progress λ, multiplier of every constraint row and of every joint bound."""

    step: Array
    progress: float
    row_multiplier: Array
    bound_multiplier: Array


@dataclass(frozen=True)
class Problem:
    """One scaled QP; ``scale`` L in mm, rows over Δq / L, λ and slacks / L; ``joints`` n and λ come first."""

    hessian: Array
    gradient: Array
    rows: Array
    bound: Array
    low: Array
    high: Array
    scale: float
    joints: int

    @property
    def row_count(self) -> int:
        """Inequality rows the way the papers count them: constraints and both sides of every joint bound."""
        return len(self.bound) + 2 * self.joints


def stack(
    objectives: Sequence[Objective], constraints: Sequence[Constraint], low: Array, high: Array, scale: float
) -> Problem:
    """One QP from all fixtures (eq. 3, 20, 21).

    Args:
        low, high: box (n,) for Δq.
        scale: L, the length of the wanted step in mm.
    """
    size = len(low) + 1
    slacks = sum(_slack_count(c) for c in constraints)
    column = np.ones(size)
    column[-1] = 1.0 / scale
    weight = np.concatenate([np.full(len(o.target), np.sqrt(o.weight)) for o in objectives])
    matrix = np.concatenate([o.matrix for o in objectives]) * column * weight[:, None]
    target = np.concatenate([o.target for o in objectives]) / scale * weight
    hessian, gradient = np.zeros((size + slacks, size + slacks)), np.zeros(size + slacks)
    hessian[:size, :size] = matrix.T @ matrix
    gradient[:size] = -(matrix.T @ target)
    rows = np.zeros((sum(len(c.bound) for c in constraints), size + slacks))
    bound = np.zeros(len(rows))
    row, slack = 0, size
    for c in constraints:
        last = row + len(c.bound)
        rows[row:last, :size] = c.matrix * column
        bound[row:last] = c.bound / scale
        if c.penalty is not None:
            count = _slack_count(c)
            columns = np.arange(slack, slack + count)
            rows[np.arange(row, last), slack if c.shared else columns] = -1.0
            hessian[columns, columns], gradient[columns] = c.penalty, c.price / scale
            slack += count
        row = last
    hessian.flat[:: size + slacks + 1] += _REGULARISATION
    none, endless = np.zeros(slacks), np.full(slacks, _UNBOUNDED)
    return Problem(
        hessian,
        gradient,
        rows,
        bound,
        np.concatenate([low / scale, [0.0], none]),
        np.concatenate([high / scale, [1.0], endless]),
        scale,
        len(low),
    )


def _slack_count(constraint: Constraint) -> int:
    """How many slacks the rows of a constraint share; a hard one has none."""
    if constraint.penalty is None or len(constraint.bound) == 0:
        return 0
    return 1 if constraint.shared else len(constraint.bound)


def holdable(problem: Problem) -> Problem:
    """The same problem with every bound widened so far that x = 0 is feasible."""
    return replace(problem, bound=np.maximum(problem.bound, 0.0))


def solve(problem: Problem, solver: str = "daqp") -> Solution | None:
    """The minimiser, or None when the problem has none or the solver's answer does not stand its check.

    Several solvers return a finite, wrong x on an infeasible problem, so the answer is judged by its residuals:
    no row violated, and the gradient balanced by multipliers of the right sign.

    Args:
        solver: 'daqp' is called natively; any other name goes through qpsolvers.
    """
    answer = _solve_natively(problem) if solver == "daqp" else _solve_by_name(problem, solver)
    if answer is None:
        return None
    x, rows, bounds = answer
    if not (np.isfinite(x).all() and _is_optimal(problem, x, rows, bounds)):
        return None
    n = problem.joints
    return Solution(x[:n] * problem.scale, float(x[n]), rows, bounds[: n + 1])


def _solve_natively(problem: Problem) -> tuple[Array, Array, Array] | None:
    size = len(problem.gradient)
    upper = np.concatenate([problem.high, problem.bound])
    lower = np.concatenate([problem.low, np.full(len(problem.bound), -_UNBOUNDED)])
    sense = np.zeros(len(upper), dtype=np.int32)
    x, _, flag, info = daqp.solve(problem.hessian, problem.gradient, problem.rows, upper, lower, sense)
    if flag != 1:
        return None
    multiplier = info["lam"]
    return x, multiplier[size:], multiplier[:size]


def _solve_by_name(problem: Problem, solver: str) -> tuple[Array, Array, Array] | None:
    if solver not in qpsolvers.available_solvers:
        known = ", ".join(sorted(qpsolvers.available_solvers))
        raise ControlError(f"QP solver '{solver}' is not installed; available are: {known}")
    convert = csc_matrix if solver in qpsolvers.sparse_solvers else np.asarray
    stated = qpsolvers.Problem(
        convert(problem.hessian),
        problem.gradient,
        convert(problem.rows),
        problem.bound,
        lb=problem.low,
        ub=problem.high,
    )
    solution = qpsolvers.solve_problem(stated, solver=solver, **_ACCURACY.get(solver, {}))
    if not solution.found or solution.x is None or solution.z is None or solution.z_box is None:
        return None
    return solution.x, solution.z, solution.z_box


def _is_optimal(problem: Problem, x: Array, rows: Array, bounds: Array) -> bool:
    """Karush-Kuhn-Tucker conditions within tolerance."""
    excess = problem.rows @ x - problem.bound
    outside = np.concatenate([excess, problem.low - x, x - problem.high])
    if outside.max() > PRIMAL_TOLERANCE:
        return False
    terms = (problem.hessian @ x, problem.gradient, problem.rows.T @ rows, bounds)
    balance = terms[0] + terms[1] + terms[2] + terms[3]
    size = 1.0 + max(float(np.abs(t).max(initial=0.0)) for t in terms)
    wrong_sign = rows.min(initial=0.0) < -DUAL_TOLERANCE * size
    return bool(np.abs(balance).max() <= DUAL_TOLERANCE * size) and not wrong_sign
