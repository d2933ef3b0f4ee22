"""Damping: joint motion costs, so that a redundant robot keeps still where the other tasks leave freedom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...virtual_fixtures import Objective, StepState, joint_regularisation
from ..context import context_of
from ..step_request import StepRequest


@dataclass(frozen=True)
class DampingTask:
    """Rows ‖W (Δq − k q̇ dt)‖²: k = 0 damps the velocity, k = 1 damps changes of the velocity.

    Args:
        weight: of the rows against another task's; W is that of the joint regularisation, see ``joint_regularisation``.
        keep: k, share of the present velocity that costs nothing, 0 to 1.
    """

    weight: float = 1.0
    keep: float = 0.0

    def request(self, state: StepState, command: Any) -> StepRequest:
        """n objective rows in mm; it asks for no motion of its own."""
        context = context_of(state)
        matrix = joint_regularisation(context.robot.robot).matrix
        target = matrix[:, :-1] @ (self.keep * state.velocity * context.settings.dt_s)
        return StepRequest((Objective(matrix, np.asarray(target), self.weight),), scale=0.0)
