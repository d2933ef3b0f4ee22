"""The papers' way to solve a step: LSI by NNLS, against scipy, and what is counted of it."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.optimize import nnls as by_scipy

from vfix_engine.errors import InputError
from vfix_engine.study.experiment.papers_program import Lsi, ProgramCounts, nnls, solve_lsi


@pytest.mark.parametrize("seed", range(30))
def test_nnls_finds_the_minimum_that_scipy_finds(seed: int) -> None:
    random = np.random.default_rng(seed)
    A, b = random.normal(size=(8, 5 + seed)), random.normal(size=8)
    found, (u, residual) = nnls(A, b), by_scipy(A, b)
    assert found.residual == pytest.approx(residual, abs=1e-9)
    np.testing.assert_allclose(A @ found.u, A @ u, atol=1e-8)
    assert (found.u >= 0.0).all()
    assert found.iterations >= (found.u > 0.0).sum()


def test_iterations_are_counted_as_lawson_and_hanson_count_them() -> None:
    """One for each unknown that becomes positive where none has to leave again; none where zero is the minimum."""
    assert nnls(np.eye(4), np.array([1.0, 2.0, 3.0, 4.0])).iterations == 4
    assert nnls(np.eye(4), np.array([1.0, -2.0, 3.0, -4.0])).iterations == 2
    assert nnls(np.eye(4), -np.ones(4)).iterations == 0
    leaving = nnls(np.array([[1.0, 1.0], [0.0, 0.05]]), np.array([1.0, -1.0]))
    assert leaving.u[1] == 0.0
    with pytest.raises(InputError, match="no minimum after 2"):
        nnls(np.eye(4), np.ones(4), most=2)


@pytest.mark.parametrize("seed", range(20))
def test_lsi_in_a_box_has_the_minimum_of_bounded_least_squares(seed: int) -> None:
    random = np.random.default_rng(seed)
    E, f = random.normal(size=(12, 7)), 3.0 * random.normal(size=12)
    box = np.vstack([np.eye(7), -np.eye(7)])
    x, iterations = solve_lsi(Lsi(E, f, box, np.full(14, 0.4)))
    assert x is not None
    np.testing.assert_allclose(x, lsq_linear(E, f, (-0.4, 0.4), method="bvls").x, atol=1e-7)
    assert iterations > 0


def test_rows_that_leave_nothing_have_no_solution() -> None:
    rows = np.vstack([np.eye(3), -np.eye(3)])
    assert solve_lsi(Lsi(np.eye(3), np.ones(3), rows, np.append(np.full(3, -0.1), np.zeros(3))))[0] is None


def test_rows_are_counted_as_the_papers_count_them() -> None:
    """24 pairs are their 39 and 37 rows."""
    counts = ProgramCounts(7, [24, 0])
    assert (counts.constraint_rows, counts.objective_rows) == ([39, 15], [37, 13])
