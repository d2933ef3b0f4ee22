"""What the operator's hand feels while the distal links are steered (Kwok 2013, section III.C)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...robots.snake import SnakeModel
from ...robots.snake_dynamics import SnakeDynamics
from ..bending.visual_motor_kernel import camera_moved
from .haptics import Forces, HapticSettings, step_forces

MEAN_S = 0.03  # [s] time constant of the means that motion and forces are


class Felt(NamedTuple):
    """What the forces of the next step go on from: means of the joints' speed and the camera's velocity, and forces."""

    speed: Array
    velocity: Array
    forces: Forces


class HandForces:
    """F = F_r + F_h of the manipulated links, from their joints step by step; bounded whatever comes.

    Joints and camera move against the frame {l} that the links hang on, so the tissue's motion is not the hand's.
    """

    def __init__(self, distal: SnakeModel, settings: HapticSettings | None = None) -> None:
        self.settings = (settings or HapticSettings()).for_links(distal.links)
        self._distal, self._dynamics = distal, SnakeDynamics(distal)
        rest = Forces(np.zeros(2), np.zeros(2), np.zeros(2))
        self.at_rest = Felt(np.zeros(distal.dof), np.zeros(2), rest)

    def step(self, felt: Felt, before: Array, after: Array, dt: float, depth: Array, outwards: Array) -> Felt:
        """With the forces (2,) in N in the camera's plane after a step of dt s.

        A step that the robot does not take stops it at once, which is nobody's haste; so speeds are means over
        ``MEAN_S``, and so are the forces.

        Args:
            felt: after the step before.
            before, after: (2L',) rad, where the joints were and are.
            depth: (L',) mm.
            outwards: (2,) where the camera goes as the links bend more; any length.
        """
        share = 1.0 - math.exp(-dt / MEAN_S)
        displacement = camera_moved(before, after, self._distal.length_mm, self._distal.camera_offset_mm)
        speed_more = share * ((after - before) / dt - felt.speed)
        velocity_more = share * (displacement / dt - felt.velocity)
        speed, velocity = felt.speed + speed_more, felt.velocity + velocity_more
        # The tissue carries the robot, and its weight is not the hand's haste: what resists comes of motion alone.
        torque = self._dynamics.weightless_torque(after, speed, speed_more / dt)
        resisting, guiding = step_forces(speed, torque, velocity, velocity_more / dt, depth, outwards, self.settings)
        was = felt.forces
        resistance = was.resistance + share * (resisting - was.resistance)
        guidance = was.guidance + share * (guiding - was.guidance)
        return Felt(speed, velocity, Forces(resistance, guidance, resistance + guidance))
