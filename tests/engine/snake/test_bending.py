"""What a bend is: Kwok 2013, eq. 10-15, against the robot's own forward kinematics and Pinocchio's."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest

from tests.engine.lumen_shapes import small_bend, straight
from vfix_engine.errors import InputError
from vfix_engine.robots import SnakeModel
from vfix_engine.robots.snake_dynamics import SnakeDynamics
from vfix_engine.snake.bending.bending import (
    DIRECTIONS,
    BendProblem,
    bend_angles,
    tip_displacement,
)

SNAKE = SnakeModel(5)
BASE = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 60.0], [0.0, 0.0, 0.0, 1.0]])


def problem(**change) -> BendProblem:
    pathway = straight(radius=20.0)
    given = {
        "snake": SNAKE,
        "vertices": SNAKE.vertices(100),
        "packed": pathway.packed(),
        "window": pathway.window(40.0, 240.0),
        "base": BASE,
        "q_nominal": np.zeros(10),
        "bound": np.full(5, 4.0),
    }
    return BendProblem(**(given | change))


def test_joint_values_are_a_line_over_joint_numbers() -> None:
    """(10) by hand for two links; with i odd the last value is q_c − m."""
    np.testing.assert_allclose(bend_angles(0.1, 0.5, 2, odd=False), [0.0, 0.1 * (2 - 4) + 0.5, 0.0, 0.5])
    np.testing.assert_allclose(bend_angles(0.1, 0.5, 2, odd=True), [0.1 * (1 - 4) + 0.5, 0.0, 0.5 - 0.1, 0.0])
    for odd in (False, True):
        assert not bend_angles(0.1, 0.5, 7, odd)[0 if not odd else 1 :: 2].any()
    for m, q_c, links in ((np.nan, 0.0, 5), (0.0, np.inf, 5), (0.0, 0.0, 0)):
        with pytest.raises(InputError):
            bend_angles(m, q_c, links, odd=False)


def test_displacement_is_that_of_pinocchio() -> None:
    dynamics, rng = SnakeDynamics(SNAKE), np.random.default_rng(3)
    data = dynamics.model.createData()
    for m, q_c, odd in [(*rng.uniform(-0.2, 0.2, 2), bool(k % 2)) for k in range(10)]:
        delta = bend_angles(m, q_c, 5, odd)
        pin.framesForwardKinematics(dynamics.model, data, delta)
        pin.updateFramePlacements(dynamics.model, data)
        last = data.oMi[dynamics.model.njoints - 1]
        reached = 1e3 * (last.translation + last.rotation @ [0.0, 0.0, 1e-3 * SNAKE.length_mm])
        np.testing.assert_allclose(tip_displacement(SNAKE, delta), reached - [0.0, 0.0, 140.0], atol=1e-9)
        assert np.abs(tip_displacement(SNAKE, delta)[0 if odd else 1]) < 1e-12


def test_the_four_directions_are_named_after_where_the_tip_goes() -> None:
    """(13), ε = 5°: +x, +y, −x, −y for e+, o+, e−, o−; two planes at a right angle."""
    ways = [small_bend(direction) for direction in DIRECTIONS]
    for quarter, d in enumerate(ways):
        towards = np.array([math.cos(quarter * math.pi / 2), math.sin(quarter * math.pi / 2)])
        assert d[:2] @ towards > 30.0
        assert abs(d[:2] @ [-towards[1], towards[0]]) < 1e-12
    np.testing.assert_allclose(ways[0] * [-1.0, 1.0, 1.0], ways[2], atol=1e-12)
    np.testing.assert_allclose(ways[1] * [1.0, -1.0, 1.0], ways[3], atol=1e-12)


def test_cost_is_the_height_of_the_tip() -> None:
    """(14): z by forward kinematics, and in closed form for a planar bend, with its gradient by m and q_c."""
    case, rng, h = problem(), np.random.default_rng(4), 1e-6
    for m, q_c in rng.uniform(-0.15, 0.15, (10, 2)):
        for odd in (False, True):
            delta = bend_angles(m, q_c, 5, odd)
            height = SNAKE.tip(delta, np.eye(4))[2, 3] / 140.0
            assert case.cost(delta) == pytest.approx(height, abs=1e-14)
            turned = np.cumsum(delta[0 if odd else 1 :: 2])  # ℓ Σ cos(Σ Δq) of parallel axes
            assert case.cost(delta) == pytest.approx(np.cos(turned).mean(), abs=1e-14)
            number = np.arange(1, 11)[0 if odd else 1 :: 2] - 10.0
            by_m, by_q = (-(np.sin(turned) * np.cumsum(rate)).mean() for rate in (number, np.ones(5)))
            up, down = case.cost(bend_angles(m + h, q_c, 5, odd)), case.cost(bend_angles(m - h, q_c, 5, odd))
            assert (up - down) / (2 * h) == pytest.approx(by_m, abs=1e-7)
            up, down = case.cost(bend_angles(m, q_c + h, 5, odd)), case.cost(bend_angles(m, q_c - h, 5, odd))
            assert (up - down) / (2 * h) == pytest.approx(by_q, abs=1e-7)
    assert case.cost(rng.normal(0.0, 0.3, 10)) < 1.0


def test_deviations_are_those_at_clamped_joints() -> None:
    """(15)-(16): what is asked is clamp(q̃ + Δq); a cylinder's deviation is known without the query."""
    rest = np.full(10, 0.1)
    case, delta = problem(q_nominal=rest), np.full(10, 5.0)
    frames = SNAKE.frames(np.full(10, SNAKE.q_max), BASE)
    points, start = case.query.vertices.points, case.query.vertices.start
    for link, depth in enumerate(case.deviations(delta)):
        placed = points[start[link] : start[link + 1]] @ frames[link + 1, :3, :3].T + frames[link + 1, :3, 3]
        assert depth == pytest.approx(max(0.0, np.hypot(placed[:, 0], placed[:, 1]).max() - 20.0), abs=1e-9)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"bound": np.array([1.0, 1.0, -1.0, 1.0, 1.0])}, "negative"),
        ({"bound": np.full(5, np.nan)}, "bound"),
        ({"bound": np.full(4, 1.0)}, "bound"),
        ({"q_nominal": np.full(10, 0.8)}, "joint limits"),
        ({"q_nominal": np.full(8, 0.0)}, "q_nominal"),
        ({"base": np.full((4, 4), np.inf)}, "base"),
        ({"window": (4, 4)}, "windows"),
        ({"window": (0, 1000)}, "windows"),
        ({"window": (0.0, 3.0)}, "windows"),
        ({"vertices": SnakeModel(4).vertices(80)}, "vertices of 4 links"),
    ],
)
def test_what_is_no_problem_is_refused(change: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        problem(**change)
