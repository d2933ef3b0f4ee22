"""Path following: the hand's force moves the tip along a path (Li 2007, eq. 9-15)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...geometry.path import SplinePath
from ...geometry.shaft_directions import ShaftDirections
from ...kernels.triples import triple
from ...virtual_fixtures import StepState
from ..request_kernel import path_request
from ..step_request import HandCommand, StepRequest
from .hand_request import context_for, request_with, shaft_objective


class PathPoint(NamedTuple):
    """Point of a path, such as the one closest to the tip: arc length s in mm, position (3,), unit tangent (3,)."""

    s: float
    position: Array
    tangent: Array

    @classmethod
    def at(cls, path: SplinePath, s: float) -> PathPoint:
        """The point at the arc length s in mm, at an end for one outside 0 … length. Raises PlanError for no number."""
        return cls(min(max(float(s), 0.0), path.length), path.position(s), path.tangent(s))


@dataclass(frozen=True, eq=False)
class FollowPath:
    """The tip follows a path, driven by the hand's force.

    Args:
        path: in the patient frame, mm.
        nearest: the path point closest to the tip, tracked by the caller along one branch from step to step;
            None: the closest point of the whole path.
        shaft: planned orientation of the shaft along the path, followed as far as the anatomy allows; None: the
            shaft rotates only where another objective requires it.
    """

    path: SplinePath
    nearest: PathPoint | None = None
    shaft: ShaftDirections | None = None

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Return four objective rows in mm with a progress variable, and three of the shaft; the torque is not used."""
        context = context_for(self, state, command)
        near = self.nearest or PathPoint(*self.path.closest(state.tip.position))
        dof, behind = context.layout.dof, float(near.s)
        matrix, target, motion_gain = np.empty((4, dof + 1)), np.empty(4), np.empty(dof)
        asked = path_request(
            *context.kernel_sizes, state.numbers, triple(command.force), triple(near.position), triple(near.tangent),
            behind, self.path.length - behind, command.reach, matrix, target, motion_gain,
        )  # fmt: skip
        if self.shaft is None:
            return request_with(matrix, target, motion_gain, asked)
        step = -float(matrix[:3, dof] @ near.tangent)  # column of the progress variable: minus the wanted motion
        turning = shaft_objective(context, state, self.shaft, behind, step, asked[0])
        return request_with(matrix, target, motion_gain, asked, more=turning)
