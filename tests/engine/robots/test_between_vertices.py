"""How much deeper a link's surface is than its vertices: the stated bound against a dense mesh of the link."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.robots.snake import SnakeModel

Array = np.ndarray
TUBE_MM = 12.0


def dense(snake: SnakeModel) -> Array:
    """Points (n, 3) of the parts of cylinder and sphere that are outside each other, 0.5 mm apart or nearer."""
    radius, ball, length = snake.radius_mm, snake.sphere_mm, snake.length_mm
    waist = -np.sqrt(ball**2 - radius**2)
    turn = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    rings = [(radius, z) for z in np.linspace(-length, waist, 60)]
    polar = np.linspace(0.0, np.arccos(waist / ball), 60)
    rings += list(zip(ball * np.sin(polar), ball * np.cos(polar), strict=True))
    return np.concatenate([np.column_stack([r * circle, np.full(len(turn), z)]) for r, z in rings])


def depth(points: Array) -> Array:
    """How far outside a tube along z points (…, 3) are, mm."""
    found: Array = np.maximum(np.hypot(points[..., 0], points[..., 1]) - TUBE_MM, 0.0)
    return found


@pytest.mark.parametrize("each", [20, 100, 400])
@pytest.mark.parametrize("ball", [None, 7.5])
def test_no_surface_is_deeper_than_its_vertices_by_more_than_is_stated(each: int, ball: float | None) -> None:
    """Behind planes that a link meets with its front or its side, and in a tube that its front leaves."""
    snake = SnakeModel(1, sphere_radius_mm=ball)
    stated = snake.between_vertices_mm(each)
    few, many = snake.vertices(each).points, dense(snake)
    random = np.random.default_rng(each)
    normals = random.standard_normal((3, 4000))
    normals[2] = np.abs(normals[2])
    normals /= np.linalg.norm(normals, axis=0)
    less = (many @ normals).max(axis=0) - (few @ normals).max(axis=0)
    assert less.max() <= stated + 1e-9
    assert less.max() > 0.75 * stated  # it is no empty bound
    for _ in range(200):
        tilt, about, roll = random.uniform(0.05, 0.42), random.uniform(0.0, 6.3), random.uniform(0.0, 6.3)
        turn = Rotation.from_rotvec([-tilt * np.sin(about), tilt * np.cos(about), 0.0])
        axes = (turn * Rotation.from_rotvec([0.0, 0.0, roll])).as_matrix()
        out = random.uniform(0.5, 4.0)  # of the sphere; the rear end stays inside
        front = (TUBE_MM + out - snake.sphere_mm) * np.array([np.cos(about), np.sin(about), 0.0])
        found, true = (float(depth(points @ axes.T + front).max()) for points in (few, many))
        assert true == pytest.approx(out, abs=0.01)
        assert true - found <= stated + 1e-9


def test_more_vertices_leave_less_between_them() -> None:
    stated = [SnakeModel(30).between_vertices_mm(each) for each in (1, 7, 8, 20, 100, 400, 1600)]
    assert stated[0] == stated[1] == 6.0
    assert all(before >= after for before, after in pairwise(stated[1:]))
    assert stated[4] == pytest.approx(0.68, abs=0.01)
    assert stated[-1] < 0.05
