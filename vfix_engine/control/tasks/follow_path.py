"""Path following: the tip follows a path at the hand's force (Li 2007, eq. 9-15)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...fixtures import StepState
from ...geometry.path import SplinePath
from ..admittance import path_velocity, saturate, slew_limited
from ..settings import ControlSettings
from ..step_request import HandCommand, StepRequest
from .wanted_motion import context_of, stoppable_speed, tip_request, velocity_change

Array = NDArray[np.float64]


class PathPoint(NamedTuple):
    """The path's point closest to the tip: arc length s in mm, position (3,), unit tangent (3,)."""

    s: float
    position: Array
    tangent: Array


@dataclass(frozen=True, eq=False)
class FollowPath:
    """The tip follows a path, driven by the hand's force.

    Args:
        path: in the patient frame, mm.
        nearest: the path's point closest to the tip, as its caller tracks it along one branch from step to step;
            None: the closest of the whole path.
    """

    path: SplinePath
    nearest: PathPoint | None = None

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Four objective rows with a progress variable; ``command.torque`` is not used."""
        near = self.nearest or PathPoint(*self.path.closest(state.tip.position))
        offset, remaining = near.position - state.tip.position, (near.s, self.path.length - near.s)
        settings = context_of(state).settings
        return follow_path(state, command.force, near.tangent, offset, remaining, settings, command.reach)


def follow_path(
    state: StepState,
    force: Array,
    tangent: Array,
    offset: Array,
    remaining: tuple[float, float],
    settings: ControlSettings,
    reach: float = np.inf,
) -> StepRequest:
    """The request of path following from what is known about the path at the tip.

    Args:
        force: (3,) in N, already capped; tangent, offset: of the path at the point closest to the tip.
        remaining: arc length behind and ahead of the tip in mm, so that no step leaves the path at its ends.
        reach: longest motion in mm.
    """
    wanted = path_velocity(
        force,
        tangent,
        offset,
        gain=settings.gain_mm_per_s_per_n,
        k_d=settings.k_d,
        k_tau=settings.k_tau,
        capture=settings.capture_mm,
    )
    wanted = saturate(wanted, min(settings.sight_speed_mm_per_s, stoppable_speed(reach, settings)))
    velocity, ramp = slew_limited(state.tip.jacobian[:3] @ state.velocity, wanted, velocity_change(settings))
    along = float(velocity @ tangent)
    kept = min(max(along, -stoppable_speed(remaining[0], settings)), stoppable_speed(remaining[1], settings))
    desired = (velocity + tangent * (kept - along)) * settings.dt_s  # eq. 12
    return tip_request(state, desired, ramp, wanted * settings.dt_s, settings)
