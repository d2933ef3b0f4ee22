"""The quadratic program of a snake's step in its pathway: objectives, the wall as rows, joint ranges and a step's size.

Every program over a snake's joints is this one: a camera command (``qp_drive.py``), a view turned to a side
(``look_plan.py`` of the drive) and a configuration projected to its limits (``projection.py``) differ in objectives.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...control.qp import solve, stack
from ...virtual_fixtures import Constraint, Objective
from .tip_control import DistalContext
from .wall_rows import wall_rows


class WallProgram:
    """minimise the objectives in (Δq, λ) subject to wall rows, joint ranges and |Δq_k| ≤ ``most``.

    Args:
        context: the links, their pathway and their bounds b_i.
        q: (2L',) rad, from where Δq counts; joints outside of their range may stay there.
        most: rad, no joint goes farther.
    """

    def __init__(self, context: DistalContext, q: Array, most: float) -> None:
        snake = context.snake
        self._context, self._q = context, q
        self._low = np.minimum(np.maximum(-most, -snake.q_max - q), 0.0)
        self._high = np.maximum(np.minimum(most, snake.q_max - q), 0.0)

    def clip(self, step: Array) -> Array:
        """The admissible step nearest to ``step`` (2L',) joint by joint; the wall is not asked."""
        clipped: Array = np.clip(step, self._low, self._high)
        return clipped

    def wall(self, step: Array, near_mm: float, margin_mm: float, least_mm: float = 0.0) -> Constraint:
        """Rows g · J Δq ≤ b_i − margin − clearance of vertices near their link's bound, linearised after ``step``.

        Linearised rows hold for small steps: those of several places of a hollow wall may be used together.

        Args:
            near_mm: vertices get rows that are so near to their bound or nearer.
            margin_mm: the rows stop so much inside of the bound.
            least_mm: slack of a row at Δq = 0 at least; 0 asks for no way back, −∞ for all of it.
        """
        snake = self._context.snake
        at = snake.clamp(self._q + step)
        rows = wall_rows(self._context, at, near_mm)
        slack = rows.slack - margin_mm + rows.matrix[:, : snake.dof] @ (at - self._q)
        return Constraint("wall", rows.matrix, np.maximum(slack, least_mm), rows.vertex, ("the wall of the pathway",))

    def solve(self, objectives: Sequence[Objective], walls: Sequence[Constraint], scale: float) -> Array | None:
        """Δq (2L',) in rad, or None where the program has no checked answer; ``scale``: the size of such a step."""
        answer = solve(stack(list(objectives), list(walls), self._low, self._high, scale))
        return None if answer is None else self.clip(answer.step)


def joint_regularisation(context: DistalContext, weight: float, target: Array | None = None) -> Objective:
    """½ w ‖ℓ Δq − ℓ target‖² with the length ℓ of a link: a joint's step as the motion of its link's end, mm."""
    snake = context.snake
    matrix = np.zeros((snake.dof, snake.dof + 1))
    matrix[:, : snake.dof] = snake.length_mm * np.eye(snake.dof)
    return Objective(matrix, np.zeros(snake.dof) if target is None else snake.length_mm * target, weight)
