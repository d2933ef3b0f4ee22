"""Free cooperative motion: no path, the tool yields to the hand in every direction (k_τ = 1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...fixtures import StepState, free_motion
from ..admittance import saturate, slew_limited
from ..settings import ControlSettings
from ..step_request import HandCommand, StepRequest
from .wanted_motion import (
    context_of,
    ramp_fraction,
    share_along,
    sight_turn,
    step_length,
    stoppable_speed,
    turn_change,
    velocity_change,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MoveFreely:
    """The tool moves and turns as the hand's force and torque ask."""

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Six objective rows."""
        return move_freely(state, command.force, command.torque, context_of(state).settings, command.reach)


def move_freely(
    state: StepState, force: Array, torque: Array, settings: ControlSettings, reach: float = np.inf
) -> StepRequest:
    """The request of free motion: force (3,) in N and torque (3,) in N·mm about the tip."""
    jacobian, lever = state.tip.jacobian, settings.view_distance_mm
    wanted = np.concatenate([settings.gain_mm_per_s_per_n * force, settings.rotation_gain_rad_per_s_per_nmm * torque])
    wanted[:3] = saturate(wanted[:3], min(settings.sight_speed_mm_per_s, stoppable_speed(reach, settings)))
    wanted[3:] = saturate(wanted[3:], sight_turn(state, settings))
    # One share for both: an angle counts as much of the change that is allowed as a displacement.
    size = _three_each(1.0 / velocity_change(settings), 1.0 / turn_change(settings))
    now = jacobian @ state.velocity
    limited, ramp = slew_limited(size * now, size * wanted, 1.0)
    desired = limited / size * settings.dt_s
    scale = _three_each(1.0, lever)
    scaled = scale * desired
    return StepRequest(
        (free_motion(state.tip, desired[:3], desired[3:], lever),),
        (),
        step_length(state, scaled, scale * wanted * settings.dt_s),
        share_along(scale[:, None] * jacobian, scaled),
        compliance=settings.gain_mm_per_s_per_n * settings.dt_s * ramp,
        ramp_fraction=ramp_fraction(size * desired, size * wanted * settings.dt_s),
    )


@lru_cache(maxsize=64)
def _three_each(first: float, second: float) -> Array:
    """(6,) read-only."""
    values = np.repeat([first, second], 3)
    values.setflags(write=False)
    return values
