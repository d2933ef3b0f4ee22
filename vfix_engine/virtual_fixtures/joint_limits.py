"""Joint limits (Li 2007, eq. 18) and joint regularisation (eq. 19)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled, no_refcount
from ..robots import RobotModel
from .fixture import Rows, Situation
from .rows import Constraint, Objective
from .state import StepState
from .stopping import stoppable_up_to

MOTION_WEIGHT = 0.01  # weight of 1 mm of joint motion relative to 1 mm of tip motion (Li 2007, eq. 19)

ROUNDING = 1e-9  # a limit missed by a smaller fraction of a step is rounding of q


def joint_bounds(robot: RobotModel, q: Array, dt: float) -> tuple[Array, Array]:
    """Box low (n,) ≤ Δq ≤ high (n,), mm or rad: q_min − q ≤ Δq ≤ q_max − q (Li 2007, eq. 18) and |Δq| ≤ q̇_max dt.

    A joint outside its range may move back but not further out.
    """
    step = robot.speed * dt
    low = np.maximum(robot.lower - q, -step)
    high = np.minimum(robot.upper - q, step)
    return np.minimum(low, 0.0), np.maximum(high, 0.0)


@no_refcount
def step_box(
    q: Array,
    velocity: Array,
    lower: Array,
    upper: Array,
    speed: Array,
    acceleration: Array,
    dt: float,
    low: Array,
    high: Array,
) -> int:
    """Write the bounds low ≤ Δq ≤ high within which every joint respects all of its limits (HAZ-06).

    Per joint, with w = q̇_prev·dt the previous step and e = a·dt²:

    - speed: |Δq| ≤ q̇_max dt;
    - acceleration: |Δq/dt − q̇_prev| ≤ a dt, that is |Δq − w| ≤ e;
    - range (Li 2007, eq. 18), with the ability to stop in it: D(Δq) ≤ upper − q and D(−Δq) ≤ q − lower, D the
      stopping distance of ``stopping.py``.

    After any step within the bounds the next bounds are feasible. Let 0 < Δq ≤ high. They contain max(Δq − e, 0), the
    hardest braking: its acceleration is allowed, it is slower, it moves away from ``lower``, and its stopping distance
    D(Δq − e) = D(Δq) − Δq ≤ (upper − q) − Δq is within the remaining slack. The same holds for Δq < 0, and after
    Δq = 0 they contain 0. So hardest braking is a stopping sequence within all limits.

    A joint outside its range may move back but not further out. If no step respects range, speed and acceleration,
    which requires a velocity that did not result from these bounds, the acceleration limit is dropped.

    Args:
        q, velocity: joints (n,) in mm or rad, and joint velocity of the previous step (n,) in mm/s or rad/s.
        lower, upper, speed, acceleration: limits (n,); ∞ is no acceleration limit.
        dt: control period in s.
        low, high: output (n,) in mm or rad.

    Returns:
        Number of joints that violate their acceleration limit; 0 for a motion that stayed within the bounds since rest.
    """
    broken = 0
    for i in range(len(q)):
        fastest = speed[i] * dt
        change = acceleration[i] * dt * dt
        last = velocity[i] * dt
        least = -stoppable_up_to(fastest, q[i] - lower[i], change)
        most = stoppable_up_to(fastest, upper[i] - q[i], change)
        slower, faster = last - change, last + change
        low[i], high[i] = max(least, slower), min(most, faster)
        if low[i] > high[i]:  # empty intersection: use the nearest end of the hard interval
            gap = low[i] - high[i]
            low[i] = high[i] = most if slower > most else least
            if gap > ROUNDING * (change + abs(last)):
                broken += 1
    return broken


@compiled
def brake(velocity: Array, acceleration: Array, dt: float) -> Array:
    """Return the next joint step (n,), in mm or rad, of a braking robot: along its joint velocity, but slower.

    All joints slow down by the same fraction, the largest that every acceleration limit allows, and stop in the same
    step, so that the tool keeps its direction while it stops. A joint near the end of its range may have to brake
    harder: ``np.clip`` to the bounds of :func:`step_box` does that within the acceleration limits.

    Args:
        velocity: joint velocity of the last step (n,); acceleration: limits (n,); dt: control period in s.
    """
    share = 1.0
    for i in range(len(velocity)):
        size = abs(velocity[i])
        if size * share > acceleration[i] * dt:
            share = acceleration[i] * dt / size
    step = np.empty(len(velocity))
    for i in range(len(velocity)):
        step[i] = velocity[i] * (1.0 - share) * dt
    return step


def joint_regularisation(robot: RobotModel) -> Objective:
    """n rows of ‖W_j Δq‖² (Li 2007, eq. 19): joint regularisation, W_j from the robot's ``joint_weights``."""
    dof = len(robot.joints)
    matrix = np.zeros((dof, dof + 1))
    matrix[:, :dof] = np.diag(MOTION_WEIGHT * robot.joint_weights)
    return Objective(matrix, np.zeros(dof))


@dataclass(frozen=True)
class JointLimits:
    """Range, speed and acceleration of every joint as a fixture, with joint regularisation.

    The controller uses the bounds of :func:`step_box` instead; this class is for programs built without a controller.
    """

    def rows(self, now: Situation) -> Rows:
        """n objective rows; constraint rows ±Δq, in mm for prismatic and in rad for revolute joints."""
        robot, dof = now.robot, len(now.robot.joints)
        low, high = np.empty(dof), np.empty(dof)
        limits = (robot.lower, robot.upper, robot.speed, robot.acceleration)
        step_box(now.state.q, now.state.velocity, *limits, now.dt_s, low, high)
        side, constraints = np.eye(dof, dof + 1), []
        for unit in ("mm", "rad"):
            own = np.array([i for i, joint in enumerate(robot.joints) if joint.unit == unit], dtype=np.int64)
            if len(own):
                matrix, bound = np.vstack([-side[own], side[own]]), np.append(-low[own], high[own])
                index = np.tile(own, 2)
                text = tuple(f"joint {i + 1} ({robot.joints[i].name})" for i in index)
                constraints.append(Constraint("joint", matrix, bound, index, text, unit=unit))
        return Rows((joint_regularisation(robot),), tuple(constraints))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        """Always True: the rows bound the step, and no pose is refused."""
        return True
