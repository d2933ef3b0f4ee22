"""A conforming shape that would leave its bounds, projected to the nearest joints that keep them.

Conformance asks for joints near the curve and does not know the bounds. Where its answer is refused, the whole body's
clearance comes in as constraint rows, as the bone does for a rigid tool.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...virtual_fixtures import Objective
from .tip_control import DistalContext
from .wall_program import WallProgram

_ROUNDS = 3  # linearisations
_NEAR_MM = 3.0
_MARGIN_MM = 0.02  # rows are true for small steps only
_SCALE = 0.01  # [rad] of a step of joints, what the program is scaled by


def projected_to_limits(context: DistalContext, q: Array, most: float) -> Array | None:
    """Joints (2L,) nearest to ``context.rest`` that keep every link within its bound, or None where none are found.

    q: (2L,) where the joints are; none goes farther from there than ``most`` rad.
    """
    program, n = WallProgram(context, q, most), context.snake.dof
    matrix = np.zeros((n + 1, n + 1))
    matrix[:n, :n] = np.eye(n) / _SCALE
    matrix[n, n] = 1.0  # no objective depends on the progress variable
    nearest = Objective(matrix, np.append((context.rest - q) / _SCALE, 0.0))
    step = program.clip(context.rest - q)
    for _ in range(_ROUNDS):
        found = program.solve([nearest], [program.wall(step, _NEAR_MM, _MARGIN_MM, -np.inf)], _SCALE)
        if found is None:
            return None
        step = found
    return q + step
