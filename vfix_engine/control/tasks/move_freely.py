"""Free cooperative motion without a path: the tool is compliant in every direction (k_τ = 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.triples import triple
from ...virtual_fixtures import StepState
from ..request_kernel import free_request
from ..step_request import HandCommand, StepRequest
from .hand_request import context_for, request_with


@dataclass(frozen=True)
class MoveFreely:
    """The tool translates and rotates with the hand's force and torque."""

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Return six objective rows in mm."""
        context = context_for(self, state, command)
        dof = context.layout.dof
        matrix, target, motion_gain = np.empty((6, dof + 1)), np.empty(6), np.empty(dof)
        asked = free_request(
            *context.kernel_sizes, state.numbers, triple(command.force), triple(command.torque), command.reach,
            matrix, target, motion_gain,
        )  # fmt: skip
        return request_with(matrix, target, motion_gain, asked)
