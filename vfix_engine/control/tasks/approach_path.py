"""Approach of path following: a tip that is off the path is guided to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.path import SplinePath
from ...geometry.shaft_directions import ShaftDirections
from ...kernels.triples import triple
from ...virtual_fixtures import StepState
from ..request_kernel import approach_request
from ..step_request import HandCommand, StepRequest
from .follow_path import PathPoint
from .hand_request import context_for, request_with, shaft_objective


@dataclass(frozen=True, eq=False)
class ApproachPath:
    """The tip moves straight to the path: the hand's force sets the speed, but not the direction.

    Args:
        path, shaft: see ``FollowPath``.
        nearest: the path's point to approach, also a chosen one (Li 2004, V): ``PathPoint.at(path, 12.0)``; None: the
            one closest to the tip.
    """

    path: SplinePath
    nearest: PathPoint | None = None
    shaft: ShaftDirections | None = None

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Return four objective rows in mm with a progress variable, and three of the shaft; the torque is not used."""
        context = context_for(self, state, command)
        near = self.nearest or PathPoint(*self.path.closest(state.tip.position))
        dof = context.layout.dof
        matrix, target, motion_gain = np.empty((4, dof + 1)), np.empty(4), np.empty(dof)
        asked = approach_request(
            *context.kernel_sizes, state.numbers, triple(command.force), triple(near.position), False, command.reach,
            matrix, target, motion_gain,
        )  # fmt: skip
        if self.shaft is None:
            return request_with(matrix, target, motion_gain, asked)
        turning = shaft_objective(context, state, self.shaft, float(near.s), 0.0, asked[0])
        return request_with(matrix, target, motion_gain, asked, more=turning)
