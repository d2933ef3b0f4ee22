"""Posture: attracts the joints to a preferred configuration within the null space of the other tasks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...validate import real_array
from ...virtual_fixtures import Objective, StepState, joint_regularisation
from ..context import context_of
from ..step_request import StepRequest


@dataclass(frozen=True, eq=False)
class PostureTask:
    """Rows ‖W (Δq − s (q* − q))‖², s = min(1, dt / time_s): the preferred configuration is approached exponentially.

    Args:
        posture: q* (n,) in mm and rad.
        weight: of the rows relative to other tasks; for W see ``joint_regularisation``.
        time_s: time constant of the approach.
        drives: False: it shapes steps that another task requests, and nothing moves without a hand.
            True: it moves the robot by itself.
    """

    posture: ArrayLike
    weight: float = 1.0
    time_s: float = 1.0
    drives: bool = False

    def request(self, state: StepState, command: Any) -> StepRequest:
        """Return n objective rows in mm.

        Raises:
            InputError: the posture is not n finite numbers.
        """
        context = context_of(state)
        posture = real_array("the posture", self.posture)
        if posture.shape != state.q.shape or not np.isfinite(posture).all():
            raise InputError(f"the posture is {posture.tolist()!r:.80}; it is {len(state.q)} finite joint values")
        share = min(1.0, context.settings.dt_s / self.time_s)
        matrix = joint_regularisation(context.robot.robot).matrix
        target = matrix[:, :-1] @ (share * (posture - state.q))
        scale = float(np.linalg.norm(share * (posture - state.q))) if self.drives else 0.0
        return StepRequest((Objective(matrix, target, self.weight),), scale=scale)
