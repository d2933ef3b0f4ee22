"""What the operator's hand feels while the distal links are steered (Kwok 2013, section III.C)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..robots.snake import SnakeModel
from ..robots.snake_dynamics import SnakeDynamics
from .haptics import Forces, HapticSettings, net

Array = NDArray[np.float64]

# The tissue carries the robot, and its weight is not the hand's haste: what resists the hand comes of motion alone.
_NO_GRAVITY = (0.0, 0.0, 0.0)


class HandForces:
    """F = F_r + F_h of the manipulated links, from their joints step by step; bounded whatever comes."""

    def __init__(self, distal: SnakeModel, settings: HapticSettings | None = None) -> None:
        self.settings = (settings or HapticSettings()).for_links(distal.links)
        self._dynamics = SnakeDynamics(distal)
        self._still = np.zeros(distal.dof)
        self.rest()

    def rest(self) -> None:
        """The links stand still."""
        self._speed, self._velocity = self._still, np.zeros(2)

    def step(self, before: Array, after: Array, dt: float, velocity: Array, depth: Array, outwards: Array) -> Forces:
        """Forces (2,) in N in the camera's plane after a step of dt s.

        Args:
            before, after: (2L',) rad; velocity: (2,) mm/s of the camera, as commanded; depth: (L',) mm.
            outwards: (2,) where the camera goes as the links bend more; any length.
        """
        speed = (after - before) / dt
        torque = self._dynamics.torque(after, speed, (speed - self._speed) / dt, _NO_GRAVITY)
        acceleration = (velocity - self._velocity) / dt
        self._speed, self._velocity = speed, velocity
        jacobian = np.column_stack([outwards, np.zeros(2)])
        return net(speed, torque, velocity, acceleration, depth, jacobian, self.settings)
