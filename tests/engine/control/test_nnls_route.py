"""The papers' own way to solve a step, as an independent reference for ours (HAZ-03).

Li 2004 and Li 2007 state each step as least squares with inequalities (LSI) and solve it by Lawson & Hanson's route,
*Solving Least Squares Problems*, chapter 23: a QR factorisation turns LSI into the problem of least distance (LDP), and
that into least squares with non-negative unknowns (NNLS). Here it starts from the fixtures' rows, never from our H.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from vfix_engine.control import qp
from vfix_engine.control.problem_kernel import REGULARISATION
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree, reduce_pairs
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.virtual_fixtures import (
    Constraint,
    Objective,
    boundary,
    joint_bounds,
    joint_regularisation,
)
from vfix_engine.virtual_fixtures.motion import point_jacobian
from vfix_engine.virtual_fixtures.polyhedra import BALL_DIRECTIONS, ball_inner
from vfix_engine.virtual_fixtures.rows import with_progress

Array = np.ndarray
SCALE = 0.01  # mm, the length of a step at 10 mm/s and 1 kHz


def by_nnls(E: Array, f: Array, G: Array, h: Array) -> Array | None:
    """The minimiser of ‖E x − f‖ subject to G x ≤ h; None where no x meets the rows."""
    Q, R = np.linalg.qr(E)
    free = np.linalg.solve(R, Q.T @ f)
    C, d = -np.linalg.solve(R.T, G.T).T, G @ free - h  # z = R (x − free): least ‖z‖ with C z ≥ d
    size = np.linalg.norm(C, axis=1)
    C, d = C / size[:, None], d / size
    system = np.vstack([C.T, d])
    wanted = np.append(np.zeros(len(free)), 1.0)
    u, rest = nnls(system, wanted, maxiter=20_000)
    if rest < 1e-9:
        return None
    r = system @ u - wanted
    return free + np.linalg.solve(R, -r[:-1] / r[-1])


def stated(
    objectives: list[Objective], constraints: list[Constraint], low: Array, high: Array
) -> tuple[Array, Array, Array, Array]:
    """The same rows as LSI over (Δq / L, λ, slacks / L): E, f, G, h."""
    n = len(low)
    column = np.append(np.ones(n), 1.0 / SCALE)
    slacks = sum(1 if c.shared else len(c.bound) for c in constraints if c.penalty is not None)
    size = n + 1 + slacks
    E = [np.sqrt(o.weight) * np.hstack([o.matrix * column, np.zeros((len(o.target), slacks))]) for o in objectives]
    f = [np.sqrt(o.weight) * o.target / SCALE for o in objectives]
    E.append(np.sqrt(REGULARISATION) * np.eye(size))
    f.append(np.zeros(size))
    G, h, at = [], [], n + 1
    for c in constraints:
        rows = np.hstack([c.matrix * column, np.zeros((len(c.bound), slacks))])
        if c.penalty is not None:
            count = 1 if c.shared else len(c.bound)
            rows[np.arange(len(c.bound)), at if c.shared else at + np.arange(count)] = -1.0
            spring = np.zeros((count, size))
            spring[np.arange(count), at + np.arange(count)] = np.sqrt(c.penalty)
            E.append(spring)
            f.append(np.full(count, -c.price / SCALE / np.sqrt(c.penalty)))
            at += count
        G.append(rows)
        h.append(c.bound / SCALE)
    limits = np.eye(size)
    G += [limits[: n + 1], -limits]
    h += [np.append(high / SCALE, 1.0), np.append(-low / SCALE, np.zeros(1 + slacks))]
    return np.vstack(E), np.concatenate(f), np.vstack(G), np.concatenate(h)


def cave(random: np.random.Generator) -> ProximityTree:
    """Splinters all around the origin, none nearer to it than the rows of a step can hold."""
    towards = random.normal(size=(400, 3))
    centre = towards / np.linalg.norm(towards, axis=1, keepdims=True) * random.uniform(1.4, 5.0, (400, 1))
    corners = centre[:, None] + 0.1 * random.normal(size=(400, 3, 3))
    return ProximityTree(TriangleMesh(corners.reshape(-1, 3), np.arange(1200).reshape(-1, 3)))


@pytest.mark.parametrize("robot_name", ["steady_hand", "dvrk_psm", "arm_7"])
@pytest.mark.parametrize("seed", range(12))
def test_several_fixtures_at_once_have_the_minimum_that_the_papers_route_finds(robot_name: str, seed: int) -> None:
    """Path, free motion, target, boundary, soft rows and joint limits in one problem, at the limits and off them."""
    random = np.random.default_rng(seed)
    robot, tool = RobotModel.load(robot_name), Tool.load("bent_30")
    q = random.uniform(robot.lower, robot.upper)
    near = random.random(len(q)) < 0.3  # some joints stand at the end of their range
    q = np.where(near, np.where(random.random(len(q)) < 0.5, robot.lower, robot.upper), q)
    there = robot.placed(np.eye(4), tool).tip(q).position
    base = np.eye(4)
    base[:3, 3] = -there
    tip = robot.placed(base, tool).tip(q)
    pairs = reduce_pairs(cave(random).pairs_within(tool.segments(tip.rotation, tip.position), 2.0))
    assert len(pairs) > 3
    desired = SCALE * random.normal(size=3)
    objectives = [joint_regularisation(robot), with_progress(tip.jacobian[:3], desired, 0.1)]
    wall = boundary(pairs, tip, float(pairs.distance.min()) - 0.2 * SCALE)
    constraints = [wall]
    if seed % 3 == 1:
        turn = 1e-3 * random.normal(size=3)
        matrix = np.vstack([tip.jacobian[:3], 15.0 * tip.jacobian[3:]])
        objectives.append(Objective(_without_progress(matrix), np.append(desired, 15.0 * turn), weight=0.3))
    if seed % 3 == 2:
        view = point_jacobian(tip, tip.position + 15.0 * tool.direction(tip.rotation))
        offset = 0.3 * SCALE * random.normal(size=3)
        objectives.append(Objective(_without_progress(view), -offset))
        room = SCALE * ball_inner() - BALL_DIRECTIONS @ offset
        constraints.append(Constraint("target", _without_progress(BALL_DIRECTIONS @ view), room, np.arange(32)))
    if seed % 2:
        soft = random.normal(size=(5, len(q) + 1))
        bound = -0.1 * SCALE * random.random(5)
        shared = seed % 4 == 1
        constraints.append(Constraint("tissue", soft, bound, np.arange(5), ("tissue",), 3.0, 0.1, shared))
    low, high = joint_bounds(robot, q, 1e-3)
    expected = by_nnls(*stated(objectives, constraints, low, high))
    solution = qp.solve(qp.stack(objectives, constraints, low, high, SCALE))
    assert expected is not None
    assert solution is not None
    n = len(q)
    np.testing.assert_allclose(solution.step / SCALE, expected[:n], atol=1e-5)
    assert solution.progress == pytest.approx(expected[n], abs=1e-5)
    assert (solution.step >= low - 1e-9).all()
    assert (solution.step <= high + 1e-9).all()


def _without_progress(rows: Array) -> Array:
    return np.hstack([rows, np.zeros((len(rows), 1))])


@pytest.mark.parametrize("seed", range(30))
def test_both_agree_on_what_has_no_solution(seed: int) -> None:
    """Rows that leave a gap, none, or a sliver between them."""
    random = np.random.default_rng(seed)
    objective = Objective(random.normal(size=(9, 8)), random.normal(size=9))
    rows, bound = random.normal(size=(12, 8)), random.uniform(0, 1, 12)
    gap = (-1e-3, 1e-3, -0.5)[seed % 3]
    direction = random.normal(size=8)
    rows[:2], bound[:2] = [direction, -direction], [0.1, gap - 0.1]
    rows[:2, -1] *= SCALE  # λ is between 0 and 1 in every unit
    constraint = Constraint("target", rows, SCALE * bound, np.arange(12))
    low, high = np.full(7, -5.0), np.full(7, 5.0)
    expected = by_nnls(*stated([objective], [constraint], low, high))
    solution = qp.solve(qp.stack([objective], [constraint], low, high, SCALE))
    assert (solution is None) == (expected is None) == (gap < 0)
