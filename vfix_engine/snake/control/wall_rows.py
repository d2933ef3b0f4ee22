"""The pathway's wall as rows of a quadratic program in a snake's joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled
from ...pathway.query.clearance import binding_vertices
from ...robots.snake_kernel import snake_jacobian
from .tip_control import DistalContext

PER_LINK = 8  # rows at most


class WallRows(NamedTuple):
    """g · J Δq ≤ slack, for vertices near their link's bound: matrix (k, 2L + 1) with λ's column 0, slack (k,) mm.

    slack is what is left to the bound, negative where it is passed; vertex: (k,) rows of ``LinkVertices.points``.
    """

    matrix: Array
    slack: Array
    vertex: IntArray


def wall_rows(context: DistalContext, q: Array, near_mm: float) -> WallRows:
    """Rows at joints q (2L,) of the vertices that have less than ``near_mm`` left to their link's bound."""
    frames = context.snake.frames(q, context.base)
    near = binding_vertices(context.query, context.packed, frames, context.window, context.bound, near_mm, PER_LINK)
    matrix = np.zeros((len(near.link), context.snake.dof + 1))
    poses = np.ascontiguousarray(frames[1:, :3])
    clearance_rows(poses, frames[0].copy(), np.array(q), near.link, near.point, near.gradient, matrix)
    return WallRows(matrix, context.bound[near.link] - near.signed, near.vertex)


@compiled
def clearance_rows(
    frames: Array, base: Array, q: Array, links: IntArray, points: Array, gradient: Array, rows: Array
) -> None:
    """g · J of points (k, 3) that ride on ``links`` (k,), written into the first 2L columns of ``rows`` (k, 2L + 1)."""
    jacobian = np.empty((3, len(q)))
    for k in range(len(points)):
        snake_jacobian(frames, base, q, links[k], points[k, 0], points[k, 1], points[k, 2], jacobian)
        for joint in range(len(q)):
            rows[k, joint] = (
                gradient[k, 0] * jacobian[0, joint]
                + gradient[k, 1] * jacobian[1, joint]
                + gradient[k, 2] * jacobian[2, joint]
            )
