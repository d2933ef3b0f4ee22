"""Inverse kinematics: joints that bring the tip to a pose, from a configuration near it, within the joints' ranges."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from .placed import PlacedRobot

Array = NDArray[np.float64]

_LEVER_MM = 100.0  # makes an angle comparable to a displacement
_TOLERANCE_MM = 1e-6
_STEPS = 200
_DAMPING = 1e-3  # of the first step, relative to the Jacobian's size


def joints_for(placed: PlacedRobot, rotation: Array, position: Array, start: Array) -> Array | None:
    """Joints (n,) within their ranges at which the tip has that pose, or None where none is found from ``start`` (n,).

    Damped least squares; of a redundant robot's many answers it is the one that few and small steps lead to.
    The tip is within 1e-6 mm of the position (3,) and within 1e-8 rad of the rotation (3, 3).
    """
    robot = placed.robot
    q = np.clip(start, robot.lower, robot.upper)
    error, jacobian = _error(placed, rotation, position, q)
    damping = _DAMPING
    for _ in range(_STEPS):
        size = float(error @ error)
        if size <= _TOLERANCE_MM**2:
            return q
        # A joint that stands at its limit and would go on outwards takes no part.
        gradient = jacobian.T @ error
        stuck = ((q <= robot.lower) & (gradient < 0)) | ((q >= robot.upper) & (gradient > 0))
        free = np.where(stuck[None, :], 0.0, jacobian)
        normal = free.T @ free
        scale = damping * np.trace(normal) / len(q) + 1e-12
        trial = np.clip(q + np.linalg.solve(normal + scale * np.eye(len(q)), free.T @ error), robot.lower, robot.upper)
        new_error, new_jacobian = _error(placed, rotation, position, trial)
        if float(new_error @ new_error) < size:
            q, error, jacobian, damping = trial, new_error, new_jacobian, max(damping / 5.0, 1e-12)
        else:
            damping *= 4.0
            if damping > 1e9:
                return None
    return None


def _error(placed: PlacedRobot, rotation: Array, position: Array, q: Array) -> tuple[Array, Array]:
    """What is missing to the pose (6,) in mm, and the Jacobian (6, n) in the same unit."""
    tip = placed.tip(q)
    turn = pin.log3(rotation @ tip.rotation.T)
    error = np.concatenate([position - tip.position, _LEVER_MM * turn])
    return error, tip.jacobian * np.repeat([1.0, _LEVER_MM], 3)[:, None]
