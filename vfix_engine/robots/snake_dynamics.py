"""Inverse dynamics of a snake through Pinocchio.

Only this module uses SI units (kg, m, s, N·m): with mm, s and N the unit of mass would be a tonne. Lengths are
converted to metres where the Pinocchio model is built.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import RobotError
from ..frames import direction_in_base
from .description import check_transform
from .snake import JOINT_SPEED, JOINT_TORQUE, SnakeModel

GRAVITY = 9.80665  # [m/s²]
_MM = 1e-3  # [m]


class SnakeDynamics:
    """Rigid-body dynamics of a snake with its base at rest; a link is a solid cylinder of its radius, length and mass.

    The centre of mass is at z = −length / 2 of the link's frame. A universal joint is a revolute joint about x and one
    about y with a massless body between them. Friction, gears, motors and contact forces are not modelled. The mass of
    a link is assumed (see ``SnakeModel``), and torques are proportional to it.

    model: ``pin.Model`` with joints "x1", "y1", "x2", … and frames "base", "link1", … at the links' far ends, in SI.
    """

    def __init__(self, snake: SnakeModel) -> None:
        self.snake = snake
        length = snake.length_mm * _MM
        solid = pin.Inertia.FromCylinder(snake.mass_kg, snake.radius_mm * _MM, length)
        middle, end = (pin.SE3(np.eye(3), np.array([0.0, 0.0, z])) for z in (0.5 * length, length))
        most = np.array([snake.q_max])
        limits = (np.array([JOINT_TORQUE]), np.array([JOINT_SPEED]), -most, most)
        model = pin.Model()
        model.name = f"snake_{snake.links}"
        model.addFrame(pin.Frame("base", 0, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
        parent = 0
        for link in range(1, snake.links + 1):
            before = end if link > 1 else pin.SE3.Identity()
            parent = model.addJoint(parent, pin.JointModelRX(), before, f"x{link}", *limits)
            parent = model.addJoint(parent, pin.JointModelRY(), pin.SE3.Identity(), f"y{link}", *limits)
            model.appendBodyToJoint(parent, solid, middle)
            model.addFrame(pin.Frame(f"link{link}", parent, 0, end, pin.FrameType.OP_FRAME))
        self.model = model
        self._weightless = model.copy()
        self._weightless.gravity.setZero()
        self._data = model.createData()

    def torque(
        self,
        q: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        gravity_in_base: ArrayLike = (0.0, 0.0, -GRAVITY),
    ) -> Array:
        """Joint torques (2L,) in N·m of a motion (recursive Newton-Euler algorithm); not thread-safe.

        Args:
            q: (2L,) rad; velocity: rad/s; acceleration: rad/s²; gravity_in_base: (3,) m/s², see ``gravity_in``.

        Raises:
            RobotError: an array of another shape, or a number that is not finite.
        """
        joints = [self._checked(given, what) for given, what in zip((q, velocity, acceleration), _MOTION, strict=True)]
        self.model.gravity.linear = _finite(gravity_in_base, (3,), "gravity")
        torque: Array = pin.rnea(self.model, self._data, *joints).copy()
        return torque

    def weightless_torque(self, q: Array, velocity: Array, acceleration: Array) -> Array:
        """As ``torque`` without gravity, of finite arrays (2L,) of a control step, which are not looked at."""
        torque: Array = pin.rnea(self._weightless, self._data, q, velocity, acceleration).copy()
        return torque

    def _checked(self, values: ArrayLike, what: str) -> Array:
        return _finite(values, (self.snake.dof,), f"{what} of a snake of {self.snake.links} links")


_MOTION = ("the joint angles", "the joint speeds", "the joint accelerations")


def gravity_in(transform_base_to_patient: ArrayLike, down_in_patient: ArrayLike = (0.0, 1.0, 0.0)) -> Array:
    """Gravity (3,) in m/s² in the frame of a base; down defaults to +y of LPS, for a patient who lies on the back.

    Raises:
        RobotError: the base is not a rigid transform, or down has no direction.
    """
    base = check_transform(np.asarray(transform_base_to_patient, dtype=float), "the snake's base")
    down = _finite(down_in_patient, (3,), "the direction of gravity")
    size = float(np.linalg.norm(down))
    if not 1e-9 < size < 1e9:
        raise RobotError(f"the direction of gravity has length {size:g}")
    gravity: Array = GRAVITY * direction_in_base(down / size, base)
    return gravity


def _finite(values: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise RobotError(f"{what}: {' x '.join(str(n) for n in shape)} finite numbers are needed")
    return array
