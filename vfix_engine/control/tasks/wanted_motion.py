"""What the guided tasks share: the velocity that is wanted, its limits, and the request that it becomes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...errors import ControlError
from ...fixtures import PathFollowing, StepState, stoppable_step
from ...fixtures.path_following import PROGRESS_REWARD as PATH_REWARD
from ...fixtures.rows import progress_weight
from ...geometry.vectors import length
from ..admittance import approach_velocity, slew_limited
from ..context import ControlContext
from ..settings import ControlSettings
from ..step_request import StepRequest

Array = NDArray[np.float64]

_NOTHING_MM = 1e-9  # a shorter wanted step is none
_TURNING_MM = 1e-6  # stands for the length of one on its way from one direction to another


def context_of(state: StepState) -> ControlContext:
    """The context that measured the state; ControlError where none did."""
    context = state.context
    if not isinstance(context, ControlContext):
        raise ControlError("the state was not measured by a ControlContext; take one from its measure()")
    return context


def tip_request(state: StepState, desired: Array, ramp: float, wish: Array, settings: ControlSettings) -> StepRequest:
    """The tip makes the step ``desired`` (3,) in mm on its way to the speed of ``wish``, a step (3,) in mm as well."""
    along = share_along(state.tip.jacobian[:3], desired)
    rows = PathFollowing(desired).at(state)
    compliance = progress_compliance(settings, ramp, PATH_REWARD)
    fraction = ramp_fraction(desired, wish)
    return StepRequest(rows.objectives, (), step_length(state, desired, wish), along, None, compliance, fraction)


def guided(
    now: Array, force: Array, towards: Array, settings: ControlSettings, reach: float
) -> tuple[Array, float, Array]:
    """Step (3,) towards a goal that stops there, the share of the change that the hand wants, and its whole wish."""
    remaining = min(length(towards), reach)
    fastest = min(settings.sight_speed_mm_per_s, stoppable_speed(remaining, settings))
    wanted = approach_velocity(force, towards, gain=settings.gain_mm_per_s_per_n, fastest=fastest)
    velocity, ramp = slew_limited(now, wanted, velocity_change(settings))
    return velocity * settings.dt_s, ramp, wanted * settings.dt_s


def ramp_fraction(desired: Array, wish: Array) -> float:
    """How much of the hand's wish a step asks for that gathers speed towards it; 1 where the hand wants nothing."""
    whole = length(wish)
    return min(length(desired) / whole, 1.0) if whole > 0.0 else 1.0


def velocity_change(settings: ControlSettings) -> float:
    """By how much the wanted velocity may change in one step, in mm/s."""
    return settings.acceleration_mm_per_s2 * settings.dt_s


def turn_change(settings: ControlSettings) -> float:
    """By how much the wanted angular velocity may change in one step, in rad/s."""
    return settings.turn_acceleration_rad_per_s2 * settings.dt_s


def stoppable_speed(remaining: float, settings: ControlSettings) -> float:
    """The speed in mm/s from which the wanted motion can come to rest within ``remaining`` mm."""
    if not remaining < np.inf:
        return np.inf
    return stoppable_step(remaining, velocity_change(settings) * settings.dt_s) / settings.dt_s


def stoppable_turn(remaining: float, settings: ControlSettings) -> float:
    """The angular speed in rad/s from which the wanted turn can come to rest within ``remaining`` rad."""
    if not remaining < np.inf:
        return np.inf
    return stoppable_step(remaining, turn_change(settings) * settings.dt_s) / settings.dt_s


def sight_turn(state: StepState, settings: ControlSettings) -> float:
    """The angular speed about the tip at which no end of the tool is faster than can be stopped in sight."""
    segments, (px, py, pz) = state.segments, state.tip.position.tolist()
    farthest = 0.0
    for x, y, z in (*segments.start.tolist(), *segments.end.tolist()):
        x, y, z = x - px, y - py, z - pz
        farthest = max(farthest, x * x + y * y + z * z)
    return settings.sight_speed_mm_per_s / max(math.sqrt(farthest), 1.0)


def progress_compliance(settings: ControlSettings, ramp: float, reward: float) -> float:
    """What a newton is worth to objectives with a progress variable, in mm/N; see ``Situation``."""
    return settings.gain_mm_per_s_per_n * settings.dt_s * ramp * progress_weight(reward)


def step_length(state: StepState, desired: Array, wish: Array) -> float:
    """Length of the wanted step, 0 where nothing is wanted.

    A tool that moves against its hand, as on its way out of a margin, comes by a wish to stand still on the way to the
    hand's. That is no rest: rows that ask for more must have their say.
    """
    size = length(desired)
    if size > _NOTHING_MM:
        return size
    return _TURNING_MM if length(wish) > _NOTHING_MM and state.velocity.any() else 0.0


def share_along(jacobian: Array, desired: Array) -> Array | None:
    """Part of the desired motion that each joint's motion (n,) makes along it; None where it is none."""
    size = float(desired @ desired)
    if not size > _NOTHING_MM * _NOTHING_MM:
        return None
    along: Array = (desired @ jacobian) / size
    return along
