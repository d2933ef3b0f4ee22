"""The distal links under the quadratic program of the sinus side, in place of the paper's parameterised control.

Unknowns are the steps of all distal joints and the progress λ along the camera command; the whole body's clearance
comes in as constraint rows. Where the paper steers two numbers on a surface of bends found beforehand, here every step
finds its own bend.
"""

from __future__ import annotations

import math
from typing import Self

import numpy as np

from ...arrays import Array
from ...virtual_fixtures import Objective
from ...virtual_fixtures.rows import with_progress
from .tip_control import DistalContext, camera_jacobian, outwards
from .wall_program import WallProgram, joint_regularisation

REWARD = 1.0  # w_λ: what progress is worth against an error across the command
REGULARISATION = 1e-2  # of a joint's step, as the motion of its link's end, against an error of the camera
PULL = 1e-3  # back to the conforming shape
MARGIN_MM = 0.05  # rows hold the links that much inside of the bound, as they are true for small steps only
NEAR_MM = 2.0 + MARGIN_MM  # vertices that are so near to their link's bound get a row
_SPEED_LIMITED = 1.0 - 1e-6  # of the fastest step: it is the joints' speed that ends it
ROUNDS = 3  # the wall is flattened again where a step that is not small meets it: so often at most


class QpControl:
    """Steps of all joints at once: camera as commanded, links within b_i, joints within ranges and speeds."""

    def __init__(self) -> None:
        self.steering, self.speed_limited, self.blocked = (0.0, 0.0), False, False
        self.unsolved = 0

    def copy(self) -> Self:
        """One that goes on by itself."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        return other

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
        self.speed_limited = False
        if length == 0.0:
            return q
        objectives = [
            *self._camera(q, camera_mm),
            joint_regularisation(context, REGULARISATION),
            joint_regularisation(context, PULL, np.clip(context.rest - q, -most, most)),
        ]
        program, step = WallProgram(context, q, most), np.zeros(n)
        walls = []
        for _ in range(1 + ROUNDS):
            walls.append(program.wall(step, NEAR_MM, MARGIN_MM))
            found = program.solve(objectives, walls, length)
            if found is None:
                self.unsolved += 1
                break
            step = found
            if self._kept(q + step):
                break
        self.speed_limited = float(np.abs(step).max()) > _SPEED_LIMITED * most
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
        return outwards(self._context.snake, q, self._context.rest)

    def _camera(self, q: Array, camera_mm: Array) -> list[Objective]:
        """What the command asks of the camera."""
        jacobian, desired = np.zeros((3, len(q))), np.zeros(3)
        jacobian[:2], desired[:2] = camera_jacobian(self._context.snake, q), camera_mm
        return [with_progress(jacobian, desired, REWARD)]

    def _kept(self, q: Array) -> bool:
        """Whether every link is within its bound."""
        context = self._context
        frames = context.snake.frames(context.snake.clamp(q), context.base)
        return bool((context.query.deviations(context.packed, frames, context.window).depth <= context.bound).all())
