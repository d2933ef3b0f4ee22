"""The stacked QP: optimal, checked by residuals, and honest about infeasible problems (HAZ-03)."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear, nnls

from vfix_engine.control import qp
from vfix_engine.control.program import Program
from vfix_engine.errors import ControlError
from vfix_engine.virtual_fixtures import Constraint, Objective

N = 7


def random_problem(seed: int, rows: int = 20) -> tuple[Objective, Constraint, Program]:
    random = np.random.default_rng(seed)
    objective = Objective(random.normal(size=(12, N + 1)), random.normal(size=12))
    constraint = Constraint("bone", random.normal(size=(rows, N + 1)), random.uniform(0, 1, rows), np.arange(rows))
    problem = qp.stack([objective], [constraint], -0.5 * np.ones(N), 0.5 * np.ones(N), scale=1.0)
    return objective, constraint, problem


def by_nonnegative_least_squares(problem: Program) -> np.ndarray:
    """The papers' own route: least distance programming through NNLS (Lawson & Hanson, LSI)."""
    size = len(problem.gradient)
    rows = np.vstack([problem.rows, np.eye(size), -np.eye(size)])
    bound = np.concatenate([problem.bound, problem.high, -problem.low])
    factor = np.linalg.cholesky(problem.hessian).T
    centre = -np.linalg.solve(problem.hessian, problem.gradient)
    G = -rows @ np.linalg.inv(factor)
    h = -(bound - rows @ centre)
    E = np.vstack([G.T, h])
    u, _ = nnls(E, np.append(np.zeros(size), 1.0), maxiter=10_000)
    r = E @ u - np.append(np.zeros(size), 1.0)
    return centre + np.linalg.solve(factor, -r[:-1] / r[-1])


@pytest.mark.parametrize("seed", range(40))
def test_minimum_agrees_with_the_papers_route(seed: int) -> None:
    _, _, problem = random_problem(seed)
    solution = qp.solve(problem)
    assert solution is not None
    np.testing.assert_allclose(
        np.append(solution.step, solution.progress), by_nonnegative_least_squares(problem), atol=1e-6
    )


def test_without_rows_it_is_bounded_least_squares() -> None:
    objective, _, _ = random_problem(5)
    problem = qp.stack([objective], [], -0.1 * np.ones(N), 0.1 * np.ones(N), scale=1.0)
    solution = qp.solve(problem)
    low, high = np.append(-0.1 * np.ones(N), 0.0), np.append(0.1 * np.ones(N), 1.0)
    expected = lsq_linear(objective.matrix, objective.target, (low, high), tol=1e-14).x
    assert solution is not None
    np.testing.assert_allclose(np.append(solution.step, solution.progress), expected, atol=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 0.01, 0.1])
def test_scale_changes_nothing_but_units(scale: float) -> None:
    """A step ten times smaller has the same shape: rows, box and target scale with it."""
    objective, constraint, whole = random_problem(11)
    small = Objective(objective.matrix * np.append(np.ones(N), scale), objective.target * scale)
    rows = Constraint(
        "bone", constraint.matrix * np.append(np.ones(N), scale), constraint.bound * scale, constraint.index
    )
    problem = qp.stack([small], [rows], -0.5 * scale * np.ones(N), 0.5 * scale * np.ones(N), scale)
    reference, solution = qp.solve(whole), qp.solve(problem)
    assert reference is not None
    assert solution is not None
    np.testing.assert_allclose(solution.step, scale * reference.step, atol=1e-9)
    assert solution.progress == pytest.approx(reference.progress, abs=1e-9)


@pytest.mark.parametrize("seed", range(200))
def test_infeasible_problems_have_no_solution(seed: int) -> None:
    _, _, problem = random_problem(seed)
    row = np.zeros((2, N + 1))
    row[0, 0], row[1, 0] = 1.0, -1.0
    problem = problem._replace(
        rows=np.vstack([problem.rows, row]),
        upper=np.append(problem.upper, [-0.2, -0.2]),
        lower=np.append(problem.lower, [-1e30, -1e30]),
    )
    assert qp.solve(problem) is None
    held = qp.solve(problem.holdable())
    assert held is not None


@pytest.mark.parametrize("value", [1e300, -1e300, np.inf, np.nan])
@pytest.mark.parametrize("solver", ["dual", "daqp"])
def test_a_row_too_large_to_be_wished_for_is_an_answer_refused(value: float, solver: str) -> None:
    """HAZ-05: the square of such a row is no number any more; that is no solution, and never an exception."""
    _, _, problem = random_problem(1)
    row = np.zeros((1, N + 1))
    row[0, :2] = value, -value
    upper, lower = np.append(problem.upper, -0.2), np.append(problem.lower, -1e30)
    held = problem._replace(rows=np.vstack([problem.rows, row]), upper=upper, lower=lower).holdable()
    assert not np.isfinite(held.hessian).all()
    assert qp.solve(held, solver) is None


def test_a_wrong_answer_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    _, _, problem = random_problem(1)
    for x in (0.1, np.nan):
        lie = (np.full(N + 1, x), 0.0, 1, {"lam": np.zeros(N + 1 + len(problem.bound))})
        monkeypatch.setattr(qp.daqp, "solve", lambda *_, lie=lie: lie)
        assert qp.solve(problem, "daqp") is None


def test_multipliers_of_limits_that_are_not_reached_are_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A feasible point whose gradient is balanced by rows that it does not touch is no minimum."""
    _, _, problem = random_problem(1)
    away = problem._replace(rows=np.eye(N + 1), upper=np.full(2 * N + 2, 10.0), lower=np.full(2 * N + 2, -1e30))
    x = np.linalg.solve(away.hessian, -away.gradient - 1.0)
    assert (np.abs(x) < 9.0).all()
    lie = (x, 0.0, 1, {"lam": np.concatenate([np.zeros(N + 1), np.ones(N + 1)])})
    monkeypatch.setattr(qp.daqp, "solve", lambda *_: lie)
    assert qp.solve(away, "daqp") is None


def test_where_our_own_solver_errs_another_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    _, _, problem = random_problem(1)
    right = qp.solve(problem, "daqp")

    def lie(*arrays: np.ndarray) -> bool:
        arrays[5][:], arrays[6][:] = 0.1, 0.0
        return True

    for wrong in (lie, lambda *_: False):
        monkeypatch.setattr(qp, "solve_dual", wrong)
        solution = qp.solve(problem)
        assert right is not None
        assert solution is not None
        np.testing.assert_array_equal(solution.step, right.step)


@pytest.mark.filterwarnings("ignore:The default value of raise_error:PendingDeprecationWarning")
@pytest.mark.parametrize("seed", range(20))
def test_osqp_through_qpsolvers_agrees(seed: int) -> None:
    """A solver chosen by name gives an answer that stands the check, and the same one."""
    _, _, problem = random_problem(seed)
    native, other = qp.solve(problem), qp.solve(problem, "osqp")
    assert native is not None
    assert other is not None
    np.testing.assert_allclose(other.step, native.step, atol=1e-6)


def test_a_solver_that_is_not_there_is_named() -> None:
    _, _, problem = random_problem(2)
    with pytest.raises(ControlError, match="no_such_solver"):
        qp.solve(problem, "no_such_solver")


@pytest.mark.parametrize("scale", [1.0, 0.01])
@pytest.mark.parametrize("solver", ["dual", "daqp"])
def test_a_soft_row_is_overdrawn_at_its_price(solver: str, scale: float) -> None:
    """½ (x − 1)² + ½ p s² + c s with x ≤ s: (1 − x) = p x + c, for one slack each and for one that is shared."""
    push = Objective(np.eye(N + 1)[:2], scale * np.ones(2))
    for shared, share in ((False, 1.0), (True, 0.5)):
        for price in (0.0, 0.1 * scale):
            rows = np.eye(N + 1)[:2]
            soft = Constraint("soft", rows, np.zeros(2), np.arange(2), ("soft",), 3.0, price, shared)
            problem = qp.stack([push], [soft], -np.ones(N), np.ones(N), scale)
            solution = qp.solve(problem, solver)
            assert solution is not None
            expected = (scale - share * price) / (1.0 + share * 3.0)
            np.testing.assert_allclose(solution.step[:2], expected, rtol=1e-6)
            hard = Constraint("hard", rows, np.zeros(2), np.arange(2))
            held = qp.solve(qp.stack([push], [hard, soft], -np.ones(N), np.ones(N), scale), solver)
            assert held is not None
            np.testing.assert_allclose(held.step[:2], 0.0, atol=1e-9)


def test_weights_say_how_much_one_fixture_counts_against_another() -> None:
    """Li 2007, eq. 1-5: the minimum of ½ Σ w ‖A x − b‖²."""
    random = np.random.default_rng(4)
    one, two = (Objective(random.normal(size=(10, N + 1)), random.normal(size=10), weight) for weight in (2.0, 0.3))
    problem = qp.stack([one, two], [], -10.0 * np.ones(N), 10.0 * np.ones(N), 1.0)
    hessian = 2.0 * one.matrix.T @ one.matrix + 0.3 * two.matrix.T @ two.matrix
    np.testing.assert_allclose(problem.hessian, hessian + 1e-9 * np.eye(N + 1), atol=1e-12)
    gradient = -(2.0 * one.matrix.T @ one.target + 0.3 * two.matrix.T @ two.target)
    np.testing.assert_allclose(problem.gradient, gradient, atol=1e-12)
