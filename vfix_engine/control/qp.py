"""Assemble all objectives and constraints into one QP, solve it, and check the solution (Li 2007, eq. 20-21).

Program: minimise ½ xᵀH x + fᵀx subject to G x ≤ h and low ≤ x ≤ high, x = (Δq, λ, slacks of soft constraints).
The step is scaled by its length L before solving, so that tolerances are independent of the speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import daqp
import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError
from ..virtual_fixtures import Constraint, Objective
from ..virtual_fixtures.state_kernel import PAIR
from .dual_kernel import solve_dual
from .problem_kernel import DUAL_TOLERANCE, PRIMAL_TOLERANCE, UNBOUNDED, check_kkt, fill, set_box
from .program import Program, Solution
from .step_kernel import program_size, program_views

_FLOAT = np.dtype(np.float64)
DUAL = "dual"  # the package's own solver, part of the compiled step
DAQP = "daqp"  # called natively


ObjectiveRows = tuple[Array, Array, Array]  # of several objectives: matrix (m, n + 1), target (m,), weight (m,)


class ConstraintRows(NamedTuple):
    """Rows of several constraints: matrix (k, n + 1), bound (k,); soft: (first row, constraint) of each soft one."""

    matrix: Array
    bound: Array
    soft: tuple[tuple[int, Constraint], ...]

    @property
    def slacks(self) -> int:
        """Number of slack variables."""
        return sum([_slack_count(constraint) for _, constraint in self.soft])


def join_objectives(objectives: Sequence[Objective], size: int) -> ObjectiveRows:
    """Stack the rows of all objectives in contiguous arrays; ``size``: n + 1."""
    if len(objectives) == 1:
        alone = objectives[0]
        matrix, target = alone.matrix, alone.target
        if _as_compiled(matrix, target, size):
            return matrix, target, _weights(len(target), alone.weight)
    for o in objectives:
        if np.shape(o.matrix) != (*np.shape(o.target), size):
            raise InputError(
                f"an objective has a matrix {np.shape(o.matrix)} and a target {np.shape(o.target)}; "
                f"m rows need (m, {size}) and (m,): {size - 1} joints and the progress variable"
            )
    count = sum([len(o.target) for o in objectives])
    matrix, target, weight = np.empty((count, size)), np.empty(count), np.empty(count)
    row = 0
    for objective in objectives:
        last = row + len(objective.target)
        matrix[row:last], target[row:last], weight[row:last] = objective.matrix, objective.target, objective.weight
        row = last
    return matrix, target, weight


def _as_compiled(matrix: Array, bound: Array, size: int) -> bool:
    """Whether the kernels accept these rows without a copy, which would take longer than this check."""
    return (
        type(matrix) is np.ndarray
        and type(bound) is np.ndarray
        and matrix.dtype is _FLOAT
        and bound.dtype is _FLOAT
        and matrix.shape == (len(bound), size)
        and matrix.flags.carray
        and bound.flags.carray
    )


@lru_cache(maxsize=256)
def _weights(count: int, weight: float) -> Array:
    return np.full(count, weight)


def join_constraints(constraints: Sequence[Constraint], size: int) -> ConstraintRows:
    """Stack the rows of all constraints in contiguous arrays; ``size``: n + 1."""
    if len(constraints) == 1:
        alone = constraints[0]
        if alone.penalty is None and _as_compiled(alone.matrix, alone.bound, size):
            return ConstraintRows(alone.matrix, alone.bound, ())
    for c in constraints:
        if np.shape(c.matrix) != (*np.shape(c.bound), size):
            raise InputError(
                f"the constraint '{c.kind}' has a matrix {np.shape(c.matrix)} and a bound {np.shape(c.bound)}; "
                f"m rows need (m, {size}) and (m,): {size - 1} joints and the progress variable"
            )
    count = sum([len(c.bound) for c in constraints])
    matrix, bound = np.empty((count, size)), np.empty(count)
    soft: list[tuple[int, Constraint]] = []
    row = 0
    for constraint in constraints:
        last = row + len(constraint.bound)
        matrix[row:last], bound[row:last] = constraint.matrix, constraint.bound
        if constraint.penalty is not None and last > row:
            soft.append((row, constraint))
        row = last
    return ConstraintRows(matrix, bound, tuple(soft))


def program_in(workspace: Array, joints: int, slacks: int, rows: int, scale: float) -> Program:
    """Return views of the program in a packed workspace, see ``step_kernel.ProgramViews``; values stay unchanged."""
    p = program_views(workspace, joints + 1 + slacks, rows)
    return Program(p.hessian, p.gradient, p.rows, p.upper, p.lower, scale, joints)


def soften(problem: Program, constraints: ConstraintRows) -> None:
    """Write the slack variables of soft constraints into a filled problem: G x − s ≤ h at the cost ½ p s² + c s."""
    slack = problem.joints + 1
    for row, constraint in constraints.soft:
        if constraint.penalty is None:
            continue
        count, last = _slack_count(constraint), row + len(constraint.bound)
        columns = np.arange(slack, slack + count)
        problem.rows[np.arange(row, last), slack if constraint.shared else columns] = -1.0
        problem.hessian[columns, columns] += constraint.penalty
        problem.gradient[columns] = constraint.price / problem.scale
        problem.upper[columns] = UNBOUNDED
        slack += count


def stack(
    objectives: Sequence[Objective], constraints: Sequence[Constraint], low: Array, high: Array, scale: float
) -> Program:
    """Build one QP from the given rows only (eq. 3, 20, 21).

    Args:
        low, high: bounds (n,) of Δq.
        scale: L, the length of the wanted step in mm.
    """
    n = len(low)
    wanted, given = join_objectives(objectives, n + 1), join_constraints(constraints, n + 1)
    workspace = np.empty(program_size(n + 1 + given.slacks, len(given.bound)))
    problem = program_in(workspace, n, given.slacks, len(given.bound), float(scale))
    fill(
        *wanted, np.zeros((n + 1, n + 1)), given.matrix, given.bound,
        _NO_PAIRS, 0, _NOTHING, np.inf, _NOTHING, _read_only(np.zeros((6, n))), scale, *problem[:5],
    )  # fmt: skip
    set_box(np.array(low, dtype=float), np.array(high, dtype=float), scale, problem.upper, problem.lower)
    soften(problem, given)
    return problem


def check_solver(solver: str) -> None:
    """Raise ControlError if ``solve`` does not support the solver."""
    if solver not in (DUAL, DAQP):
        from .named_solvers import check_name  # imports every installed solver: half a second

        check_name(solver, (DUAL, DAQP))


def solve(problem: Program, solver: str = DUAL, own_failed: bool = False) -> Solution | None:
    """Return the minimiser, or None if there is none or the solver's result fails its check.

    Several solvers return a finite, wrong x for an infeasible problem, so the residuals of the Karush-Kuhn-Tucker
    conditions are checked: feasibility, stationarity, and multipliers of the right sign on active rows only.

    Args:
        solver: 'dual' is the package's own (``dual_kernel``), 'daqp' is called natively; others go through qpsolvers.
        own_failed: 'dual' already ran in the fused kernel and found no solution that passes the check.
    """
    if solver == DUAL:
        # Where rounding errors defeat the dual solver, another one is tried before the step is given up.
        own = None if own_failed else _checked(problem, _solve_here(problem))
        return own or _checked(problem, _solve_natively(problem))
    if solver == DAQP:
        return _checked(problem, _solve_natively(problem))
    from .named_solvers import solve_by_name

    check_solver(solver)
    return _checked(problem, solve_by_name(problem, solver))


def _checked(problem: Program, answer: tuple[Array, Array] | None) -> Solution | None:
    """Return the solution if there is one and it passes the check."""
    if answer is None:
        return None
    x, multiplier = answer
    if not check_kkt(*problem[:5], x, multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE):
        return None
    n = problem.joints
    return Solution(x[:n] * problem.scale, x[n], multiplier, len(x))


def _solve_here(problem: Program) -> tuple[Array, Array] | None:
    x, multiplier = np.empty(len(problem.gradient)), np.empty(len(problem.upper))
    return (x, multiplier) if solve_dual(*problem[:5], x, multiplier) else None


def _solve_natively(problem: Program) -> tuple[Array, Array] | None:
    sense = np.zeros(len(problem.upper), dtype=np.int32)
    x, _, flag, info = daqp.solve(problem.hessian, problem.gradient, problem.rows, problem.upper, problem.lower, sense)
    return (x, info["lam"]) if flag == 1 else None


def _slack_count(constraint: Constraint) -> int:
    """Number of slack variables that the rows of a constraint share; 0 for a hard one."""
    if constraint.penalty is None or len(constraint.bound) == 0:
        return 0
    return 1 if constraint.shared else len(constraint.bound)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    array.setflags(write=False)
    return array


_NOTHING = _read_only(np.zeros(0))
# No pairs, with the dtypes of a state's pairs, so that the kernels need no second compilation.
_NO_PAIRS = _read_only(np.zeros((0, PAIR)))
