"""Target inspection: the virtual point ahead of the tip reaches a target, then the tool swings about it (Li 2007)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...fixtures import ReachTarget, StepState, TargetInspection, view_jacobian
from ...fixtures.rows import progress_weight
from ...fixtures.target_inspection import PROGRESS_REWARD as VIEW_REWARD
from ...given import point
from ...robots import Tool
from ..admittance import saturate, slew_limited
from ..settings import ControlSettings
from ..step_request import HandCommand, StepRequest
from .wanted_motion import (
    context_of,
    guided,
    progress_compliance,
    ramp_fraction,
    share_along,
    sight_turn,
    step_length,
    stoppable_turn,
    turn_change,
)

Array = NDArray[np.float64]

_IDENTITY = np.eye(3)
_IDENTITY.setflags(write=False)


@dataclass(frozen=True, eq=False)
class ApproachTarget:
    """The virtual point P_v, ``view_distance_mm`` ahead of the tip, moves straight to a target at the hand's speed.

    Args:
        target: (3,) in the patient frame, mm.
    """

    target: ArrayLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", point("the target", self.target))

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Four objective rows with a progress variable; ``command.torque`` is not used."""
        context, target = context_of(state), np.asarray(self.target)
        return approach_target(state, context.tool, command.force, target, context.settings, command.reach)


@dataclass(frozen=True, eq=False)
class InspectTarget:
    """The virtual point stays on a target while the hand's torque swings the tool about it (eq. 22-25).

    Args:
        target: (3,) in the patient frame, mm.
    """

    target: ArrayLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", point("the target", self.target))

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Seven objective rows, 32 planes and their verdict; ``command.force`` is not used, ``reach`` is in rad."""
        context, target = context_of(state), np.asarray(self.target)
        return inspect_target(state, context.tool, command.torque, target, context.settings, command.reach)


def view_point(state: StepState, tool: Tool, distance: float) -> Array:
    """P_v (3,): the point ``distance`` mm ahead of the tip on the optical axis."""
    point: Array = state.tip.position + distance * tool.direction(state.tip.rotation)
    return point


def approach_target(
    state: StepState, tool: Tool, force: Array, target: Array, settings: ControlSettings, reach: float = np.inf
) -> StepRequest:
    """The request that guides P_v onto the target (3,) at the hand's speed."""
    jacobian = view_jacobian(state.tip, settings.view_distance_mm, tool.direction(state.tip.rotation))
    towards = target - view_point(state, tool, settings.view_distance_mm)
    desired, ramp, wish = guided(jacobian @ state.velocity, force, towards, settings, reach)
    rows = ReachTarget(desired, settings.view_distance_mm, tool.direction(_IDENTITY)).at(state)
    along, length = share_along(jacobian, desired), step_length(state, desired, wish)
    compliance = progress_compliance(settings, ramp, VIEW_REWARD)
    return StepRequest(rows.objectives, (), length, along, None, compliance, ramp_fraction(desired, wish))


def inspect_target(
    state: StepState, tool: Tool, torque: Array, target: Array, settings: ControlSettings, reach: float = np.inf
) -> StepRequest:
    """The request of an inspection: the torque (3,) in N·mm swings the tool while P_v stays on the target.

    ``reach`` is the largest turn in rad.
    """
    wanted = settings.rotation_gain_rad_per_s_per_nmm * torque
    wanted = saturate(wanted, min(sight_turn(state, settings), stoppable_turn(reach, settings)))
    spin, ramp = slew_limited(state.tip.jacobian[3:] @ state.velocity, wanted, turn_change(settings))
    turn, lever = spin * settings.dt_s, settings.view_distance_mm
    fixture = TargetInspection(
        target,
        turn,
        settings.target_tolerance_mm,
        lever,
        tool.direction(_IDENTITY),
        settings.approach_deceleration_mm_per_s2,
    )
    rows = fixture.at(state, settings.dt_s)
    return StepRequest(
        rows.objectives,
        rows.constraints,
        lever * step_length(state, turn, wanted * settings.dt_s),
        share_along(state.tip.jacobian[3:], turn),
        lambda after: fixture.is_admissible(state, after),
        lever**2 * settings.rotation_gain_rad_per_s_per_nmm * settings.dt_s * ramp * progress_weight(VIEW_REWARD),
        ramp_fraction(turn, wanted * settings.dt_s),
    )
