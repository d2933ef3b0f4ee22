"""The compiled dual active-set method against daqp: ordinary, degenerate, contradictory and badly scaled programs."""

import daqp
import numpy as np
import pytest

from vfix_engine.control.dual_kernel import solve_dual
from vfix_engine.control.problem_kernel import check_kkt
from vfix_engine.control.qp import DUAL_TOLERANCE, PRIMAL_TOLERANCE

TOLERANCES = (PRIMAL_TOLERANCE, DUAL_TOLERANCE)


def program(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """H, f, G, upper, lower: every third may be infeasible, every fourth has rows twice, others share one corner."""
    random = np.random.default_rng(seed)
    size, rows = int(random.integers(2, 13)), int(random.integers(0, 45))
    matrix = random.normal(size=(size + 2, size)) * 10 ** random.uniform(-2, 1, size)
    normals = random.normal(size=(rows, size))
    bound = random.uniform(-0.2 if seed % 3 == 0 else 0.0, 1.0, rows)
    if seed % 4 == 0 and rows > 4:
        normals[rows // 2 :], bound[rows // 2 :] = normals[: rows - rows // 2], bound[: rows - rows // 2]
    if seed % 7 == 0:
        bound[:] = 0.0
    upper = np.concatenate([random.uniform(0.0, 1.0, size), bound])
    lower = np.concatenate([random.uniform(-1.0, 0.0, size), np.full(rows, -1e30)])
    if seed % 5 == 0:
        lower[:2] = upper[:2]
    hessian = matrix.T @ matrix + 1e-9 * np.eye(size)
    return hessian, random.normal(size=size) * 10 ** random.uniform(-2, 1), normals, upper, lower


def test_it_finds_the_same_minimum_or_none() -> None:
    feasible = infeasible = 0
    for seed in range(3000):
        hessian, gradient, normals, upper, lower = program(seed)
        x, multiplier = np.empty(len(gradient)), np.empty(len(upper))
        found = solve_dual(hessian, gradient, normals, upper, lower, x, multiplier)
        reference, _, flag, _ = daqp.solve(
            hessian, gradient, normals, upper, lower, np.zeros(len(upper), dtype=np.int32)
        )
        assert found == (flag == 1), seed
        if not found:
            infeasible += 1
            continue
        feasible += 1
        assert check_kkt(hessian, gradient, normals, upper, lower, x, multiplier, *TOLERANCES), seed
        cost, expected = (0.5 * y @ hessian @ y + gradient @ y for y in (x, reference))
        assert cost == pytest.approx(expected, rel=1e-6, abs=1e-7), seed
        assert (x <= upper[: len(x)]).all()
        assert (x >= lower[: len(x)]).all()
    assert feasible > 1000
    assert infeasible > 300


def test_a_matrix_that_is_not_positive_definite_has_no_answer() -> None:
    size = 4
    x, multiplier = np.empty(size), np.empty(size)
    limits = np.ones(size), -np.ones(size)
    for hessian in (np.diag([1.0, 1.0, 0.0, 1.0]), np.diag([1.0, -1.0, 1.0, 1.0]), np.full((size, size), np.nan)):
        assert not solve_dual(hessian, np.ones(size), np.zeros((0, size)), *limits, x, multiplier)


def test_numbers_that_are_none_are_no_answer() -> None:
    """HAZ-05: whatever comes out of nonsense does not stand the check."""
    random = np.random.default_rng(2)
    for seed in range(400):
        parts = [part.copy() for part in program(seed)]
        part = parts[int(random.integers(5))]
        if part.size == 0:
            continue
        part.flat[int(random.integers(part.size))] = random.choice([np.nan, np.inf, -np.inf])
        x, multiplier = np.empty(len(parts[1])), np.empty(len(parts[3]))
        if solve_dual(*parts, x, multiplier) and check_kkt(*parts, x, multiplier, *TOLERANCES):
            assert np.isfinite(x).all()
