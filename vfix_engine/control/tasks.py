"""The tasks of Li 2007, section IV, each for one step: follow the path, inspect a target, move freely.

Every task asks for a velocity that differs from the present one by no more than an acceleration allows (``eased``),
that can still stop where the task ends, and that the boundary can stop in sight of anatomy.
``force`` may be a hand's on the grip, or the spring's of a master in teleoperation; then ``reach`` is how far the
master is ahead, where the motion has to end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..fixtures import (
    FreeMotion,
    PathFollowing,
    ReachTarget,
    TargetInspection,
    ToolState,
    stoppable_step,
    view_jacobian,
)
from ..fixtures.path_following import PROGRESS_REWARD as PATH_REWARD
from ..fixtures.rows import progress_weight
from ..fixtures.target_inspection import PROGRESS_REWARD as VIEW_REWARD
from ..robots import Tool
from .admittance import approach_velocity, eased, path_velocity, saturate
from .settings import ControlSettings
from .task import Task

Array = NDArray[np.float64]

_NOTHING_MM = 1e-9  # a shorter wanted step is none
_TURNING_MM = 1e-6  # stands for the length of one on its way from one direction to another


def follow_path(
    state: ToolState,
    force: Array,
    tangent: Array,
    offset: Array,
    room: tuple[float, float],
    settings: ControlSettings,
    reach: float = np.inf,
) -> Task:
    """Path following (eq. 9-15).

    Args:
        force: (3,) in N, already capped; tangent, offset: of the path at the point closest to the tip.
        room: arc length behind and ahead of the tip in mm, so that no step leaves the path at its ends.
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
    wanted = saturate(wanted, min(settings.sight_speed_mm_per_s, _stoppable(reach, settings)))
    velocity, ease = eased(state.tip.jacobian[:3] @ state.velocity, wanted, _change(settings))
    along = float(velocity @ tangent)
    kept = min(max(along, -_stoppable(room[0], settings)), _stoppable(room[1], settings))
    desired = (velocity + tangent * (kept - along)) * settings.dt_s  # eq. 12
    return _tip_task(state, desired, ease, wanted * settings.dt_s, settings)


def approach_path(
    state: ToolState, force: Array, towards: Array, settings: ControlSettings, reach: float = np.inf
) -> Task:
    """The approach phase: the tip is guided onto the path at the hand's speed; ``towards`` (3,) leads to it."""
    desired, ease, wish = _guided(state.tip.jacobian[:3] @ state.velocity, force, towards, settings, reach)
    return _tip_task(state, desired, ease, wish, settings)


def approach_target(
    state: ToolState, tool: Tool, force: Array, target: Array, settings: ControlSettings, reach: float = np.inf
) -> Task:
    """Approach of target inspection: the virtual point P_v is guided onto the target (3,) at the hand's speed."""
    jacobian, point = _view(state, tool, settings)
    desired, ease, wish = _guided(jacobian @ state.velocity, force, target - point, settings, reach)
    rows = ReachTarget(desired, settings.view_distance_mm, tool.direction(np.eye(3))).at(state)
    along = _along(jacobian, desired)
    compliance = _compliance(settings, ease, VIEW_REWARD)
    return Task(rows.objectives, (), _scale(state, desired, wish), along, None, compliance, _part(desired, wish))


def inspect_target(
    state: ToolState, tool: Tool, torque: Array, target: Array, settings: ControlSettings, reach: float = np.inf
) -> Task:
    """Target inspection (eq. 22-25): the torque (3,) in N·mm swings the tool while P_v stays on the target.

    ``reach`` is the largest turn in rad.
    """
    wanted = settings.rotation_gain_rad_per_s_per_nmm * torque
    wanted = saturate(wanted, min(_sight_turn(state, settings), _stoppable_turn(reach, settings)))
    spin, ease = eased(state.tip.jacobian[3:] @ state.velocity, wanted, _turn_change(settings))
    turn, lever = spin * settings.dt_s, settings.view_distance_mm
    fixture = TargetInspection(
        target,
        turn,
        settings.target_tolerance_mm,
        lever,
        tool.direction(np.eye(3)),
        settings.approach_deceleration_mm_per_s2,
    )
    rows = fixture.at(state, settings.dt_s)
    return Task(
        rows.objectives,
        rows.constraints,
        lever * _scale(state, turn, wanted * settings.dt_s),
        _along(state.tip.jacobian[3:], turn),
        lambda after: fixture.keeps(state, after),
        lever**2 * settings.rotation_gain_rad_per_s_per_nmm * settings.dt_s * ease * progress_weight(VIEW_REWARD),
        _part(turn, wanted * settings.dt_s),
    )


def move_freely(
    state: ToolState, force: Array, torque: Array, settings: ControlSettings, reach: float = np.inf
) -> Task:
    """Free cooperative motion: no path, the tool yields to the hand in every direction (k_τ = 1)."""
    jacobian, lever = state.tip.jacobian, settings.view_distance_mm
    wanted = np.concatenate([settings.gain_mm_per_s_per_n * force, settings.rotation_gain_rad_per_s_per_nmm * torque])
    wanted[:3] = saturate(wanted[:3], min(settings.sight_speed_mm_per_s, _stoppable(reach, settings)))
    wanted[3:] = saturate(wanted[3:], _sight_turn(state, settings))
    # One share for both: an angle counts as much of the change that is allowed as a displacement.
    size = np.repeat([1.0 / _change(settings), 1.0 / _turn_change(settings)], 3)
    now = jacobian @ state.velocity
    eased_velocity, ease = eased(size * now, size * wanted, 1.0)
    desired = eased_velocity / size * settings.dt_s
    rows = FreeMotion(desired[:3], desired[3:], lever).at(state)
    scale = np.repeat([1.0, lever], 3)
    return Task(
        rows.objectives,
        (),
        _scale(state, scale * desired, scale * wanted * settings.dt_s),
        _along(scale[:, None] * jacobian, scale * desired),
        compliance=settings.gain_mm_per_s_per_n * settings.dt_s * ease,
        begun=_part(size * desired, size * wanted * settings.dt_s),
    )


def view_point(state: ToolState, tool: Tool, distance: float) -> Array:
    """P_v (3,): the point ``distance`` mm ahead of the tip on the optical axis."""
    point: Array = state.tip.position + distance * tool.direction(state.tip.rotation)
    return point


def _tip_task(state: ToolState, desired: Array, ease: float, wish: Array, settings: ControlSettings) -> Task:
    """The tip makes the step ``desired`` (3,) in mm on its way to the speed of ``wish``, a step (3,) in mm as well."""
    along = _along(state.tip.jacobian[:3], desired)
    rows = PathFollowing(desired).at(state)
    compliance = _compliance(settings, ease, PATH_REWARD)
    return Task(rows.objectives, (), _scale(state, desired, wish), along, None, compliance, _part(desired, wish))


def _view(state: ToolState, tool: Tool, settings: ControlSettings) -> tuple[Array, Array]:
    axis = tool.direction(state.tip.rotation)
    jacobian = view_jacobian(state.tip, settings.view_distance_mm, axis)
    return jacobian, view_point(state, tool, settings.view_distance_mm)


def _guided(
    now: Array, force: Array, towards: Array, settings: ControlSettings, reach: float
) -> tuple[Array, float, Array]:
    """Step (3,) towards a goal that stops there, the share of the change that the hand wants, and its whole wish."""
    room = min(float(np.linalg.norm(towards)), reach)
    fastest = min(settings.sight_speed_mm_per_s, _stoppable(room, settings))
    wanted = approach_velocity(force, towards, gain=settings.gain_mm_per_s_per_n, fastest=fastest)
    velocity, ease = eased(now, wanted, _change(settings))
    return velocity * settings.dt_s, ease, wanted * settings.dt_s


def _part(desired: Array, wish: Array) -> float:
    """How much of the hand's wish a step asks for that gathers speed towards it; 1 where the hand wants nothing."""
    whole = float(np.linalg.norm(wish))
    return min(float(np.linalg.norm(desired)) / whole, 1.0) if whole > 0.0 else 1.0


def _change(settings: ControlSettings) -> float:
    """By how much the wanted velocity may change in one step, in mm/s."""
    return settings.acceleration_mm_per_s2 * settings.dt_s


def _turn_change(settings: ControlSettings) -> float:
    return settings.turn_acceleration_rad_per_s2 * settings.dt_s


def _stoppable(room: float, settings: ControlSettings) -> float:
    """The speed in mm/s from which the wanted motion can come to rest within ``room`` mm."""
    return stoppable_step(room, _change(settings) * settings.dt_s) / settings.dt_s if room < np.inf else np.inf


def _stoppable_turn(room: float, settings: ControlSettings) -> float:
    return stoppable_step(room, _turn_change(settings) * settings.dt_s) / settings.dt_s if room < np.inf else np.inf


def _sight_turn(state: ToolState, settings: ControlSettings) -> float:
    """Turning speed in rad/s about the tip at which no end of the tool is faster than can be stopped in sight."""
    ends = np.concatenate([state.segments.start, state.segments.end]) - state.tip.position
    return settings.sight_speed_mm_per_s / max(float(np.sqrt((ends * ends).sum(axis=1).max())), 1.0)


def _compliance(settings: ControlSettings, ease: float, reward: float) -> float:
    """What a newton is worth to objectives with a progress variable, in mm/N; see ``Situation``."""
    return settings.gain_mm_per_s_per_n * settings.dt_s * ease * progress_weight(reward)


def _scale(state: ToolState, desired: Array, wish: Array) -> float:
    """Length of the wanted step, 0 where nothing is wanted.

    A tool that moves against its hand, as on its way out of a margin, comes by a wish to stand still on the way to the
    hand's. That is no rest: rows that ask for more must have their say.
    """
    length = float(np.linalg.norm(desired))
    if length > _NOTHING_MM:
        return length
    return _TURNING_MM if float(np.linalg.norm(wish)) > _NOTHING_MM and state.velocity.any() else 0.0


def _along(jacobian: Array, desired: Array) -> Array | None:
    """Part of the desired motion that each joint's motion (n,) makes along it; None where it is none."""
    size = float(desired @ desired)
    if not size > _NOTHING_MM * _NOTHING_MM:
        return None
    along: Array = (desired @ jacobian) / size
    return along
