"""The distal links under a quadratic program that turns the view to the side to which the hand pulls the camera.

As ``qp_drive.py``, with one more objective: an S of the links moves the camera to a side and turns its view to the
other, which satisfies a command that asks for the camera's position only.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...virtual_fixtures import Objective
from ..bending.visual_motor_kernel import camera_moved, camera_rows
from .qp_drive import QpControl
from .tip_control import camera_jacobian

LEVER_MM = 20.0  # a view turned by 1 rad counts as a camera moved by so much; that far ahead lies what a hand pulls at
LEAST_PROGRESS = 0.5  # of the commanded motion: a step that keeps less is said to be blocked


class ViewControl(QpControl):
    """Steps of all joints at once: camera and view as commanded, links within b_i, joints within ranges and speeds."""

    def wanted(self, q: Array, camera_mm: Array, most: float) -> Array:
        """Joints after the step that the program finds; q itself where it finds none."""
        target = super().wanted(q, camera_mm, most)
        snake, asked = self._context.snake, float(camera_mm @ camera_mm)
        moved = camera_moved(q, target, snake.length_mm, snake.camera_offset_mm)
        self.blocked = not self.speed_limited and float(moved @ camera_mm) < LEAST_PROGRESS * asked
        return target

    def _camera(self, q: Array, camera_mm: Array) -> list[Objective]:
        """The camera's motion, and its view turned alike: ℓ ∂z/∂q Δq = λ ΔP_d with the lever ℓ."""
        snake = self._context.snake
        ahead = camera_rows(q, snake.length_mm, snake.camera_offset_mm + LEVER_MM)
        turn = np.column_stack([ahead - camera_jacobian(snake, q), -camera_mm])
        return [*super()._camera(q, camera_mm), Objective(turn, np.zeros(2))]
