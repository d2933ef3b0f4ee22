"""The approach of path following: a tip that is off the path is guided onto it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...fixtures import StepState
from ...geometry.path import SplinePath
from ..settings import ControlSettings
from ..step_request import HandCommand, StepRequest
from .follow_path import PathPoint
from .wanted_motion import context_of, guided, tip_request

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ApproachPath:
    """The tip moves straight to the path at the hand's speed: the hand's force sets the speed, not the direction.

    Args:
        path, nearest: see ``FollowPath``.
    """

    path: SplinePath
    nearest: PathPoint | None = None

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Four objective rows with a progress variable; ``command.torque`` is not used."""
        near = self.nearest or PathPoint(*self.path.closest(state.tip.position))
        towards = near.position - state.tip.position
        return approach_path(state, command.force, towards, context_of(state).settings, command.reach)


def approach_path(
    state: StepState, force: Array, towards: Array, settings: ControlSettings, reach: float = np.inf
) -> StepRequest:
    """The request of an approach; ``towards`` (3,) in mm leads from the tip to the path."""
    desired, ramp, wish = guided(state.tip.jacobian[:3] @ state.velocity, force, towards, settings, reach)
    return tip_request(state, desired, ramp, wish, settings)
