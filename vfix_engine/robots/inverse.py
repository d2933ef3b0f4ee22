"""Inverse kinematics of a placed robot by damped least squares, within the joint ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from .model import PlacedRobot

_LEVER_MM = 100.0  # length by which angles are multiplied
_TOLERANCE_MM = 1e-6
_STEPS = 200
_DAMPING = 1e-3  # initial damping, relative to the mean diagonal of JᵀJ


@dataclass(frozen=True, eq=False)
class IkResult:
    """Result of :func:`inverse_kinematics`.

    q: joints (n,) in mm or rad, inside their ranges.
    found: whether the pose is reached.
    position_error_mm: distance of the tip from the desired position; 0 where found.
    stopped: indices of the joints at a limit whose further motion would reduce the error.
    """

    q: Array
    found: bool
    position_error_mm: float
    stopped: tuple[int, ...]


def inverse_kinematics(placed: PlacedRobot, rotation: Array, position: Array, start: Array) -> IkResult:
    """Return joints that move the tip to a pose, or as near to it as their ranges allow.

    Damped least squares (Levenberg-Marquardt) from ``start``; for a redundant robot the result is near ``start``.
    A pose counts as reached within 1e-6 mm and 1e-8 rad.

    Args:
        placed: the robot with its base in the patient frame.
        rotation, position: desired pose of the tip (3, 3) and (3,) in mm, patient frame.
        start: joints (n,) in mm or rad.
    """
    robot = placed.robot
    q = np.clip(start, robot.lower, robot.upper)
    error, jacobian = _error(placed, rotation, position, q)
    damping = _DAMPING
    for _ in range(_STEPS):
        size = float(error @ error)
        if size <= _TOLERANCE_MM**2:
            return IkResult(q, True, 0.0, ())
        # A joint at its limit that would move beyond it is kept fixed.
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
    return IkResult(q, False, float(np.linalg.norm(error[:3])), tuple(int(joint) for joint in stopped))


def _error(placed: PlacedRobot, rotation: Array, position: Array, q: Array) -> tuple[Array, Array]:
    """Pose error (6,) in mm, angles times the lever, and its Jacobian (6, n)."""
    import pinocchio as pin  # imported here: slow to load

    tip = placed.tip(q)
    turn = pin.log3(rotation @ tip.rotation.T)
    error = np.concatenate([position - tip.position, _LEVER_MM * turn])
    return error, tip.jacobian * np.repeat([1.0, _LEVER_MM], 3)[:, None]
