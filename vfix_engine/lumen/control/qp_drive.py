"""The distal links under the quadratic program of the sinus side, in place of the paper's parameterised control.

Unknowns are the steps of all distal joints and the progress λ along the camera command; the whole body's clearance
comes in as constraint rows. Where the paper steers two numbers on a surface of bends found beforehand, here every step
finds its own bend.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...control.qp import solve, stack
from ...fixtures import Constraint, Objective
from ...fixtures.rows import with_progress
from .tip_control import DistalContext, camera_jacobian, outwards
from .wall_rows import wall_rows

Array = NDArray[np.float64]

REWARD = 1.0  # w_λ: what progress is worth against an error across the command
SMALL_MOTION = 1e-2  # of a joint's step, as the way its link's end goes, against an error of the camera
PULL = 1e-3  # back to the conforming shape
NEAR_MM = 2.0  # [mm] vertices that are so near to their link's bound get a row
KEEP_MM = 0.05  # [mm] rows hold the links that much inside of the bound, as they are true for small steps only
_HURRIED = 1.0 - 1e-6  # of the fastest step: it is the joints' speed that ends it
ROUNDS = 3  # the wall is flattened again where a step that is not small meets it: so often at most


class QpControl:
    """Steps of all joints at once: camera as commanded, links within b_i, joints within ranges and speeds."""

    def __init__(self) -> None:
        self.steering, self.hurried = (0.0, 0.0), False
        self.unsolved = 0

    def prepare(self, context: DistalContext, q: Array) -> None:
        """Nothing is found beforehand."""
        self._context = context

    def move_to(self, context: DistalContext) -> None:
        """The links' context moved."""
        self._context = context

    def wanted(self, q: Array, camera_mm: Array, most: float) -> Array:
        """Joints after the step that the program finds; q itself where it finds none."""
        context, snake = self._context, self._context.snake
        n = snake.dof
        length = float(np.linalg.norm(camera_mm))
        self.hurried = False
        if length == 0.0:
            return q
        jacobian, desired = np.zeros((3, n)), np.zeros(3)
        jacobian[:2], desired[:2] = camera_jacobian(snake, q, context.base), camera_mm
        lever = np.zeros((n, n + 1))
        lever[:, :n] = snake.length_mm * np.eye(n)
        objectives = [
            with_progress(jacobian, desired, REWARD),
            Objective(lever, np.zeros(n), SMALL_MOTION),
            Objective(lever, snake.length_mm * np.clip(context.rest - q, -most, most), PULL),
        ]
        low, high = np.maximum(-most, -snake.q_max - q), np.minimum(most, snake.q_max - q)
        low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
        walls, step = [self._clearance(q, np.zeros(n))], np.zeros(n)
        for _ in range(1 + ROUNDS):
            answer = solve(stack(objectives, walls, low, high, length))
            if answer is None:
                self.unsolved += 1
                break
            step = np.clip(answer.step, low, high)
            if self._kept(q + step):
                break
            walls.append(self._clearance(q, step))
        self.hurried = float(np.abs(step).max()) > _HURRIED * most
        return snake.clamp(q + step)

    def lead(self, steering: tuple[float, float]) -> None:
        """Nothing is steered."""

    def ends(self, first: int) -> str:
        """No bends are known beforehand."""
        return ""

    def accept(self, share: float) -> None:
        """Nothing is steered."""

    def bent(self, q: Array, rest: Array) -> float:
        """How far the joint is that is farthest from the conforming shape, against 45°."""
        return float(np.abs(q - rest).max()) / math.radians(45.0)

    def outwards(self, q: Array) -> Array:
        """Where the camera goes as the bend grows in proportion."""
        return outwards(self._context.snake, q, self._context.base, self._context.rest)

    def _kept(self, q: Array) -> bool:
        """Whether every link is within its bound."""
        context = self._context
        frames = context.snake.frames(context.snake.clamp(q), context.base)
        return bool((context.query.deviations(context.packed, frames, context.window).depth <= context.bound).all())

    def _clearance(self, q: Array, step: Array) -> Constraint:
        """g · J Δq ≤ b_i − signed distance, of vertices near their link's bound; never asking for a way back.

        The wall is flattened where it is met after ``step``. Of a hollow wall that is true on the inner side of it,
        so what was found of other steps may stay.
        """
        context, snake = self._context, self._context.snake
        near = NEAR_MM + KEEP_MM
        at = snake.clamp(q + step)
        rows = wall_rows(context, at, near)
        slack = np.maximum(rows.slack - KEEP_MM + rows.matrix[:, : snake.dof] @ (at - q), 0.0)
        return Constraint("wall", rows.matrix, slack, rows.vertex, ("the wall of the pathway",))
