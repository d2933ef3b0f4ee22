"""The planned orientation of a shaft along a path: between its stations, its roll, and what it refuses."""

import math

import numpy as np
import pytest

from vfix_engine.errors import PlanError
from vfix_engine.geometry.shaft_directions import ShaftDirections, roll_of, rolled_frame, upright_frame

RANDOM = np.random.default_rng(5)


def angle(a: np.ndarray, b: np.ndarray) -> float:
    return math.degrees(math.acos(min(1.0, float(a @ b))))


def test_an_upright_frame_bends_towards_superior() -> None:
    frame = upright_frame(np.array([0.0, 1.0, 0.0]))
    assert frame @ frame.T == pytest.approx(np.eye(3))
    assert np.linalg.det(frame) == pytest.approx(1.0)
    assert frame[:, 2] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize("roll", [-3.0, -1.0, 0.0, 0.4, 2.9])
def test_the_roll_of_a_frame_is_the_one_that_it_was_made_with(roll: float) -> None:
    direction = RANDOM.normal(size=3)
    frame = rolled_frame(direction, roll)
    assert frame[:, 1] == pytest.approx(-direction / np.linalg.norm(direction))
    assert roll_of(frame) == pytest.approx(roll)


def test_a_positive_roll_is_right_handed_about_the_direction_towards_the_tail() -> None:
    frame = rolled_frame([0.0, -1.0, 0.0], math.pi / 2)  # the tail lies anterior, the bend pointed to superior
    assert frame[:, 2] == pytest.approx(np.cross([0.0, -1.0, 0.0], [0.0, 0.0, 1.0]))


def test_between_two_stations_the_direction_goes_along_the_great_circle_evenly() -> None:
    first, second = np.array([0.0, -1.0, 0.0]), np.array([0.0, -1.0, 1.0]) / math.sqrt(2.0)
    plan = ShaftDirections([10.0, 30.0], [first, second])
    assert not plan.has_roll
    for s, degrees in ((0.0, 0.0), (10.0, 0.0), (15.0, 11.25), (20.0, 22.5), (30.0, 45.0), (99.0, 45.0)):
        found = plan.direction(s)
        assert angle(found, first) == pytest.approx(degrees, abs=1e-6)
        assert found @ np.cross(first, second) == pytest.approx(0.0, abs=1e-12)


def test_frames_meet_the_given_rolls_and_are_rotations_in_between() -> None:
    directions = RANDOM.normal(size=(5, 3)) + np.array([0.0, -3.0, 0.0])
    rolls = RANDOM.uniform(-3.0, 3.0, 5)
    plan = ShaftDirections(np.arange(5.0), directions, rolls)
    for s in range(5):
        assert plan.frame(float(s)) == pytest.approx(rolled_frame(directions[s], rolls[s]), abs=1e-9)
    every = plan.frame(np.linspace(-1.0, 5.0, 200))
    assert np.einsum("nij,nkj->nik", every, every) == pytest.approx(np.broadcast_to(np.eye(3), (200, 3, 3)), abs=1e-9)
    steps = np.einsum("nij,nij->n", every[1:], every[:-1])
    assert np.degrees(np.arccos(np.clip(0.5 * (steps - 1.0), -1.0, 1.0))).max() < 8.0  # no jump anywhere


def test_the_roll_goes_the_shorter_way_round() -> None:
    direction = [0.0, -1.0, 0.0]
    plan = ShaftDirections([0.0, 10.0], [direction] * 2, np.radians([170.0, -170.0]))
    assert abs(math.degrees(roll_of(plan.frame(5.0)))) == pytest.approx(180.0)


def test_a_roll_that_is_given_once_is_carried_along_without_a_twist() -> None:
    plan = ShaftDirections([0.0, 10.0], [[0.0, -1.0, 0.0], [0.2, -1.0, 0.1]], [0.5, np.nan])
    assert plan.has_roll
    turn = plan.frame(10.0) @ plan.frame(0.0).T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    assert axis @ plan.direction(0.0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("stations", "directions", "rolls"),
    [
        ([], np.zeros((0, 3)), None),
        ([0.0, 0.0], [[0, 1, 0]] * 2, None),
        ([0.0, np.nan], [[0, 1, 0]] * 2, None),
        ([0.0], [[0, 0, 0]], None),
        ([0.0, 1.0], [[0, 1, 0], [0, -1, 0]], None),
        ([0.0], [[0, 1, 0]], [1.0, 2.0]),
        ([0.0], [[0, 1, 0]], [np.inf]),
    ],
)
def test_what_is_no_plan_is_refused(stations: list[float], directions: list[list[float]], rolls: list[float]) -> None:
    with pytest.raises(PlanError):
        ShaftDirections(stations, directions, rolls)
