"""A conforming shape that would leave its bounds, projected: the nearest joints that keep them, as a quadratic program.

Conformance asks for joints near the curve and does not know the bounds. Where its answer is refused, the whole body's
clearance comes in as constraint rows, as the bone does on the sinus side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...control.qp import solve, stack
from ...fixtures import Constraint, Objective
from .tip_control import DistalContext
from .wall_rows import wall_rows

Array = NDArray[np.float64]

_ROUNDS = 3  # linearisations
_NEAR_MM = 3.0
_KEEP_MM = 0.02  # [mm] rows are true for small steps only
_SCALE = 0.01  # [rad] of a step of joints, what the program is scaled by


def projected_to_limits(context: DistalContext, q: Array, most: float) -> Array | None:
    """Joints (2L,) nearest to ``context.rest`` that keep every link within its bound, or None where none are found.

    q: (2L,) where the joints are; none goes farther from there than ``most`` rad.
    """
    snake, wanted = context.snake, context.rest
    n = snake.dof
    low, high = np.maximum(q - most, -snake.q_max), np.minimum(q + most, snake.q_max)
    low, high = np.minimum(low, q), np.maximum(high, q)
    matrix = np.zeros((n + 1, n + 1))
    matrix[:n, :n] = np.eye(n) / _SCALE
    matrix[n, n] = 1.0  # nothing wants the progress variable
    found = np.clip(wanted, low, high)
    for _ in range(_ROUNDS):
        rows = wall_rows(context, found, _NEAR_MM)
        target = np.append((wanted - found) / _SCALE, 0.0)
        wall = Constraint("wall", rows.matrix, rows.slack - _KEEP_MM, rows.vertex, ("the wall of the pathway",))
        answer = solve(stack([Objective(matrix, target)], [wall], low - found, high - found, _SCALE))
        if answer is None:
            return None
        found = np.clip(found + answer.step, low, high)
    return found
