"""The snake's links as triangles, for pictures: each a cylinder and the sphere that rounds its joint."""

from __future__ import annotations

import numpy as np
import trimesh

from ....arrays import Array, IntArray
from ....geometry.mesh import TriangleMesh
from ....robots.snake import SnakeModel


def robot_shape(snake: SnakeModel, frames: Array, first: int, last: int) -> tuple[TriangleMesh, IntArray]:
    """Surfaces of the links first … last − 1 in the patient frame, and of each triangle the link (F,) it belongs to.

    frames: (L + 1, 4, 4) as ``SnakeModel.frames`` gives them.
    """
    tube = trimesh.creation.cylinder(radius=snake.radius_mm, height=snake.length_mm, sections=32)
    ball = trimesh.creation.icosphere(subdivisions=2, radius=snake.sphere_mm)
    # A link's frame has its origin at its far end, where the next joint is.
    points = np.concatenate([tube.vertices - np.array([0.0, 0.0, 0.5 * snake.length_mm]), ball.vertices])
    faces = np.concatenate([tube.faces, ball.faces + len(tube.vertices)])
    vertices = [points @ frame[:3, :3].T + frame[:3, 3] for frame in frames[first + 1 : last + 1]]
    numbered = [faces + number * len(points) for number in range(last - first)]
    mesh = TriangleMesh(np.concatenate(vertices), np.concatenate(numbered))
    return mesh, np.repeat(np.arange(first, last), len(faces))
