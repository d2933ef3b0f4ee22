"""Solvers by name, through the interface of qpsolvers: slower than the two that ``qp`` calls itself, and many."""

from __future__ import annotations

from typing import Any

import numpy as np
import qpsolvers
from scipy.sparse import csc_matrix

from ..arrays import Array
from ..errors import ControlError
from .program import Program

LARGEST = 1e15  # of a number in a problem that goes to a solver by name
# What a solver is asked for so that its answer passes the check: by default a first-order one stops too early.
_ACCURACY: dict[str, dict[str, Any]] = {"osqp": {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iter": 20_000}}


def check_name(solver: str, ours: tuple[str, ...]) -> None:
    """ControlError unless qpsolvers knows that solver and it is installed; ``ours``: known besides."""
    if solver not in qpsolvers.available_solvers:
        known = ", ".join(sorted({*ours, *qpsolvers.available_solvers}))
        raise ControlError(f"QP solver '{solver}' is not installed; available are: {known}")


def solve_by_name(problem: Program, solver: str) -> tuple[Array, Array] | None:
    """The solver's x and multipliers, as it found them; None where it has no answer."""
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
        return None  # beyond what a solver can factor; some print about it, some raise
    try:
        solution = qpsolvers.solve_problem(stated, solver=solver, **_ACCURACY.get(solver, {}))
    except Exception:  # whatever a solver of somebody else raises: it has no answer (HAZ-03)
        return None
    if not solution.found or solution.x is None or solution.z is None or solution.z_box is None:
        return None
    return np.array(solution.x, dtype=float), np.concatenate([solution.z_box, solution.z]).astype(float)
