"""Inverse kinematics: joints that bring the tip to a pose, from a configuration near it, within the joints' ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from .placed import PlacedRobot

Array = NDArray[np.float64]

_LEVER_MM = 100.0  # makes an angle comparable to a displacement
_TOLERANCE_MM = 1e-6
_STEPS = 200
_DAMPING = 1e-3  # of the first step, relative to the Jacobian's size


@dataclass(frozen=True, eq=False)
class Reached:
    """q (n,): joints nearest to a pose; short_mm: how far the tip is from its position there.

    found: the pose is met. stopped: numbers of the joints that stand at a limit and would go on.
    """

    q: Array
    found: bool
    short_mm: float
    stopped: tuple[int, ...]


def joints_for(placed: PlacedRobot, rotation: Array, position: Array, start: Array) -> Array | None:
    """Joints (n,) within their ranges at which the tip has that pose, or None where none is found; see `reach`."""
    reached = reach(placed, rotation, position, start)
    return reached.q if reached.found else None


def reach(placed: PlacedRobot, rotation: Array, position: Array, start: Array) -> Reached:
    """Joints within their ranges that bring the tip to a pose from ``start`` (n,), or as near to it as they go.

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
            return Reached(q, True, 0.0, ())
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
                break
    gradient = jacobian.T @ error
    stopped = np.flatnonzero(((q <= robot.lower) & (gradient < 0)) | ((q >= robot.upper) & (gradient > 0)))
    return Reached(q, False, float(np.linalg.norm(error[:3])), tuple(int(joint) for joint in stopped))


def _error(placed: PlacedRobot, rotation: Array, position: Array, q: Array) -> tuple[Array, Array]:
    """What is missing to the pose (6,) in mm, and the Jacobian (6, n) in the same unit."""
    tip = placed.tip(q)
    turn = pin.log3(rotation @ tip.rotation.T)
    error = np.concatenate([position - tip.position, _LEVER_MM * turn])
    return error, tip.jacobian * np.repeat([1.0, _LEVER_MM], 3)[:, None]
