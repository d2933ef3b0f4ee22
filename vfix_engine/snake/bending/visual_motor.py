"""The camera follows the hand: motions in the picture become motions on the surface of bends (Kwok 2013, eq. 24-29)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError
from ...robots.snake import SnakeModel
from ...validate import real_array
from .hermite import PolarHermite
from .visual_motor_kernel import camera_rows, steer

_FAR = 1e6  # [mm] upper limit of a commanded distance: squares of larger ones overflow


class BendDirection(NamedTuple):
    """A point on the surface of bends, (u, v) = r (cos ϑ, sin ϑ)."""

    u: float
    v: float

    @property
    def r(self) -> float:
        """How far the links are bent, 1 at the control bends."""
        return math.hypot(self.u, self.v)

    @property
    def theta(self) -> float:
        """Direction, rad in (−π, π]; 0 at rest."""
        return math.atan2(self.v, self.u)


class VisualMotor:
    """Moves the camera of the distal links along the axes of its own picture: x to the right, y down, mm.

    Joints beyond their limits stay at them, and changes of their Q have no effect.

    Args:
        snake: the distal links alone; hermite: their surface of bends; base_of_l: (4, 4) transform of the frame {l}
            that they hang on to the patient frame, which only ``camera`` depends on.

    Raises:
        InputError: a surface of another number of joints, or a base that is not (4, 4) of finite numbers.
    """

    def __init__(self, snake: SnakeModel, hermite: PolarHermite, base_of_l: ArrayLike) -> None:
        base = np.array(base_of_l, dtype=np.float64)
        if base.shape != (4, 4) or not np.isfinite(base).all():
            raise InputError("the frame of the distal links is a transform (4, 4) of finite numbers")
        if len(hermite.q_nominal) != snake.dof:
            raise InputError(f"bends of {len(hermite.q_nominal)} joints for links with {snake.dof}")
        base.setflags(write=False)
        self.snake, self.hermite, self.base = snake, hermite, base

    def joints(self, state: BendDirection) -> Array:
        """Joints (2L',) at a point of the surface, within their limits, rad."""
        return self.snake.clamp(self.hermite.cartesian(*state)[0])

    def camera(self, state: BendDirection) -> Array:
        """transform_camera_to_patient (4, 4) at a point of the surface (24)."""
        return self.snake.camera(self.joints(state), self.base)

    def jacobian(self, r: float, theta: float) -> Array:
        """J (2, 2): motion of the camera in its picture in mm by r and by ϑ in rad (28)."""
        return self._in_picture(self.hermite.value(r, theta), self.hermite.partials(r, theta))

    def jacobian_uv(self, state: BendDirection) -> Array:
        """The same by u and v, regular at r = 0 (2, 2), mm."""
        return self._in_picture(*self.hermite.cartesian(*state))

    def step(self, state: BendDirection, wanted: ArrayLike) -> BendDirection:
        """The steering with which the camera moves by ``wanted`` (2,) mm in its picture, or as near as possible.

        Computed in (u, v), which is regular at r = 0. Where bends cannot move the camera so, it moves to the nearest
        position; r stays within the surface's r_max. Near a singular point many joints may move far at once: the
        caller limits their speed.

        Raises:
            InputError: a motion that is not two finite numbers, or a non-finite steering.
        """
        if not (math.isfinite(state[0]) and math.isfinite(state[1])):
            raise InputError(f"a surface of bends has no place ({state[0]}, {state[1]})")
        right, down = self._wanted(wanted)
        hermite, snake = self.hermite, self.snake
        u, v = steer(
            hermite.angles, hermite.coefficients, hermite.q_nominal, snake.q_max, snake.length_mm,
            snake.camera_offset_mm, hermite.r_max, float(state[0]), float(state[1]), right, down,
        )  # fmt: skip
        return BendDirection(u, v)

    def _in_picture(self, q: Array, partials: Array) -> Array:
        """Rows of the camera (2, 2L') times partial derivatives (2L', 2) of q."""
        limit = self.snake.q_max
        rows = camera_rows(np.clip(q, -limit, limit), self.snake.length_mm, self.snake.camera_offset_mm)
        free = np.abs(q) <= limit
        moved: Array = rows[:, free] @ partials[free]
        return moved

    @staticmethod
    def _wanted(wanted: ArrayLike) -> tuple[float, float]:
        given = real_array("a wanted motion of the camera", wanted)
        if given.shape != (2,) or not np.isfinite(given).all():
            raise InputError("a wanted motion of the camera is two finite numbers, mm")
        right, down = float(given[0]), float(given[1])
        size = max(abs(right), abs(down))
        return (right, down) if size <= _FAR else (right / size * _FAR, down / size * _FAR)
