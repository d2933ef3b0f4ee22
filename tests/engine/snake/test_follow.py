"""The followable curve: kept where a lumen is gentle, rounded where it is not, and in the room there is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vfix_engine.errors import PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.conform.follow import followable
from vfix_engine.snake.conform.joint_places import joint_places

SNAKE = SnakeModel(5)


def chord_turns(curve: Curve) -> np.ndarray:
    """Turns in rad between links in a row, over the whole curve at many phases."""
    links = int(curve.length / SNAKE.length_mm) - 1
    found = []
    for tip in curve.length - np.linspace(0.0, SNAKE.length_mm, 15):
        places, joints = np.empty(links + 1), np.empty((links + 1, 3))
        joint_places(curve.points, curve.tangents, curve.step_mm, float(tip), SNAKE.length_mm, places, joints)
        along = np.diff(joints[places >= 0.0], axis=0) / SNAKE.length_mm
        found.append(np.arccos(np.clip(np.einsum("ij,ij->i", along[1:], along[:-1]), -1.0, 1.0)))
    return np.concatenate(found)


def away(points: np.ndarray, line: Curve) -> np.ndarray:
    return np.array([np.linalg.norm(line.points - point, axis=1).min() for point in points])


def zigzag() -> Curve:
    """A wiggle of 9 mm every 70 mm, as a centreline has from fold to fold."""
    z = np.linspace(0.0, 420.0, 300)
    return Curve.through(np.column_stack([9.0 * np.sin(z * 2.0 * math.pi / 70.0), 4.0 * np.cos(z / 31.0), z]))


def test_a_gentle_lumen_is_kept():
    angle = np.linspace(0.0, 2.0, 200)
    line = Curve.through(np.column_stack([100.0 * (1.0 - np.cos(angle)), 0.0 * angle, 100.0 * np.sin(angle)]))
    found = followable((line, np.full(len(line.points), 15.0)), SNAKE)
    assert away(found.points, line).max() < 1.5


@pytest.mark.parametrize("radius", [8.0, 16.0])
def test_both_ends_stay(radius: float):
    """With room and without it, at an end that wiggles too: what is followed begins and ends at the clicks."""
    line = zigzag()
    found = followable((line, np.full(len(line.points), radius)), SNAKE)
    np.testing.assert_allclose(found.points[[0, -1]], line.points[[0, -1]], atol=1e-3)


def test_wiggles_are_rounded_within_the_room():
    line = zigzag()
    found = followable((line, np.full(len(line.points), 16.0)), SNAKE)
    assert chord_turns(line).max() > math.radians(60.0)
    assert chord_turns(found).max() < math.radians(53.0)
    assert away(found.points, line).max() < 16.0 - SNAKE.radius_mm + 0.5


def test_where_there_is_no_room_the_curve_stays():
    line = zigzag()
    found = followable((line, np.full(len(line.points), 8.0)), SNAKE)
    assert away(found.points, line).max() < 5.0
    assert chord_turns(found).max() < chord_turns(line).max()


def test_a_nearer_curve_leaves_the_slack_less():
    """Half turns of 12 mm radius, whose middle no curve of such links keeps to: what counts more is given up less."""
    turn = np.linspace(0.0, math.pi, 40)
    half = np.column_stack([24.0 - 12.0 * np.cos(turn) - 12.0, 0.0 * turn, 12.0 * np.sin(turn)])
    back = np.column_stack([48.0 - 12.0 * np.cos(turn) - 12.0, 0.0 * turn, -12.0 * np.sin(turn)])
    before = np.column_stack([0.0 * turn, 0.0 * turn, np.linspace(-60.0, -1.0, 40)])
    line = Curve.through(np.concatenate([before, half, back[1:]]))
    radius = np.full(len(line.points), 11.0)
    off = [away(followable((line, radius), SNAKE, nearness=much).points, line).max() for much in (1.0, 2.0, 4.0)]
    assert off[0] > off[1] > off[2]
    with pytest.raises(PathwayError, match="nearness"):
        followable((line, radius), SNAKE, nearness=0.0)


def test_what_is_no_lumen_is_refused():
    line = zigzag()
    with pytest.raises(PathwayError, match="as many finite radii"):
        followable((line, np.full(7, 10.0)), SNAKE)
    with pytest.raises(PathwayError, match="as many finite radii"):
        followable((line, np.full(len(line.points), np.nan)), SNAKE)
    with pytest.raises(PathwayError, match="turn"):
        followable((line, np.full(len(line.points), 10.0)), SNAKE, turn=0.0)
    with pytest.raises(PathwayError, match="too short"):
        followable((Curve.through([[0.0, 0, 0], [0, 0, 60.0]]), np.full(121, 10.0)), SNAKE)
