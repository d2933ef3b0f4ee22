"""Path following with the program that the papers print (Li 2004, III; Li 2007, eq. 12-21), for presets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...geometry.path import SplinePath
from ...virtual_fixtures import Constraint, Objective, StepState
from ...virtual_fixtures.motion import point_jacobian
from ..step_request import HandCommand, StepRequest
from .follow_path import FollowPath, PathPoint

DEMAND = "progress"  # kind of the row of (14)


@dataclass(frozen=True)
class PrintedWeights:
    """Weights and tolerance of the printed program; the joints' W_j is that of the robot (``joint_weights``).

    tip_mm, tip_rad: w_t of translation and rotation in (15), per mm and per rad; near: w_k of (17), per mm.
    tolerance: ε_t of (14), the fraction of the desired motion that may be missing.

    Raises:
        InputError: a weight is negative or not finite, or the tolerance is not between 0 and 1.
    """

    tip_mm: float = 1.0
    tip_rad: float = 0.1
    near: float = 0.01
    tolerance: float = 0.01

    def __post_init__(self) -> None:
        for name in ("tip_mm", "tip_rad", "near"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise InputError(f"the weight {name} is {getattr(self, name)!r:.40}; it is a finite number from 0 on")
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"the tolerance of (14) is {self.tolerance!r:.40}; it is between 0 and 1")


@dataclass(frozen=True, eq=False)
class PrintedPath:
    """``FollowPath`` without progress variable: ζ_t with the rotational rows of (12)-(13), ζ_k of (17), and (14).

    (14) is a hard row, which has no solution as soon as anatomy stops the tool: ``RigidSystem`` then takes the step of
    ``FollowPath`` and counts it. The desired motion is that of ``FollowPath``, with its slew and stopping limits.

    Args:
        path, nearest: see ``FollowPath``; weights: of the program.
    """

    path: SplinePath
    nearest: PathPoint
    weights: PrintedWeights = PrintedWeights()

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Return 6 objective rows of the tip, 3 for each near pair, and one constraint row."""
        usual = FollowPath(self.path, self.nearest).request(state, command)
        weights, tip = self.weights, state.tip
        desired = -usual.objectives[0].matrix[:3, -1]  # column of the progress variable: minus ΔP_d
        dof = tip.jacobian.shape[1]
        matrix, target = np.zeros((6, dof + 1)), np.zeros(6)
        matrix[:3, :dof], matrix[3:, :dof] = weights.tip_mm * tip.jacobian[:3], weights.tip_rad * tip.jacobian[3:]
        target[:3] = weights.tip_mm * desired
        objectives = [Objective(matrix, target)]
        if weights.near > 0.0 and len(state.pairs):
            near = np.zeros((3 * len(state.pairs), dof + 1))
            for i, pair in enumerate(state.pairs):
                near[3 * i : 3 * i + 3, :dof] = weights.near * point_jacobian(tip, pair[4:7])
            objectives.append(Objective(near, np.zeros(len(near))))
        return StepRequest(
            tuple(objectives), self._demand(tip.jacobian[:3], desired), usual.scale, usual.motion_gain, None,
            usual.compliance, usual.ramp_fraction,
        )  # fmt: skip

    def _demand(self, jacobian: Array, desired: Array) -> tuple[Constraint, ...]:
        """Row −ΔP_d·J Δq ≤ −(1 − ε) ‖ΔP_d‖² of (14), divided by ‖ΔP_d‖ so that it is in mm."""
        size = float(np.linalg.norm(desired))
        if size == 0.0:
            return ()
        row = np.zeros((1, jacobian.shape[1] + 1))
        row[0, :-1] = -(desired / size) @ jacobian
        bound = np.array([-(1.0 - self.weights.tolerance) * size])
        return (Constraint(DEMAND, row, bound, np.zeros(1, np.int64), ("the demanded progress",)),)
