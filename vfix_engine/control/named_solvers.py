"""Solvers by name through qpsolvers: slower than the two that ``qp`` calls itself, but many."""

from __future__ import annotations

from typing import Any

import numpy as np
import qpsolvers
from scipy.sparse import csc_matrix

from ..arrays import Array
from ..errors import ControlError
from .program import Program

LARGEST = 1e15  # largest magnitude in a problem that is passed to a named solver
# Options for the accuracy that the check requires: first-order solvers stop too early by default.
_ACCURACY: dict[str, dict[str, Any]] = {"osqp": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20_000}}


def check_name(solver: str, ours: tuple[str, ...]) -> None:
    """Raise ControlError unless qpsolvers supports the solver and it is installed; ``ours``: further valid names."""
    if solver not in qpsolvers.available_solvers:
        known = ", ".join(sorted({*ours, *qpsolvers.available_solvers}))
        raise ControlError(f"QP solver '{solver}' is not installed; available are: {known}")


def solve_by_name(problem: Program, solver: str) -> tuple[Array, Array] | None:
    """Return the solver's x and multipliers, unchecked; None if it has no solution."""
    convert = csc_matrix if solver in qpsolvers.sparse_solvers else np.asarray
    stated = qpsolvers.Problem(
        convert(problem.hessian),
        problem.gradient,
        convert(problem.rows),
        problem.bound,
        lb=problem.low,
        ub=problem.high,
    )
    parts = (problem.hessian, problem.gradient, problem.rows, np.minimum(problem.bound, 0.0))
    if not all(np.abs(part).max(initial=0.0) < LARGEST for part in parts):
        return None  # not factorable numerically; some solvers print, some raise
    try:
        solution = qpsolvers.solve_problem(stated, solver=solver, **_ACCURACY.get(solver, {}))
    except Exception:  # any failure of a third-party solver counts as no solution (HAZ-03)
        return None
    if not solution.found or solution.x is None or solution.z is None or solution.z_box is None:
        return None
    return np.array(solution.x, dtype=float), np.concatenate([solution.z_box, solution.z]).astype(float)
