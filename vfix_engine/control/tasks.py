"""The tasks of Li 2007, section IV, each for one step: follow the path, inspect a target, move freely."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..fixtures import (
    ToolState,
    centre_target,
    free_motion,
    hold_target,
    path_following,
    reach_target,
    swing,
    view_jacobian,
)
from ..fixtures.path_following import PROGRESS_REWARD as PATH_REWARD
from ..fixtures.rows import progress_weight
from ..fixtures.target_inspection import PROGRESS_REWARD as VIEW_REWARD
from ..robots import Tool
from .admittance import approach_velocity, path_velocity
from .controller import Task
from .settings import ControlSettings

Array = NDArray[np.float64]

_NOTHING_MM = 1e-9  # a shorter wanted step is none


def follow_path(
    state: ToolState,
    force: Array,
    tangent: Array,
    offset: Array,
    room: tuple[float, float],
    settings: ControlSettings,
) -> Task:
    """Path following (eq. 9-15).

    Args:
        force: (3,) in N, already capped; tangent, offset: of the path at the point closest to the tip.
        room: arc length behind and ahead of the tip in mm, so that no step leaves the path at its ends.
    """
    velocity = path_velocity(
        force,
        tangent,
        offset,
        gain=settings.gain_mm_per_s_per_n,
        k_d=settings.k_d,
        k_tau=settings.k_tau,
        capture=settings.capture_mm,
    )
    desired = velocity * settings.dt_s  # eq. 12
    along = float(desired @ tangent)
    desired = desired + tangent * (min(max(along, -room[0]), room[1]) - along)
    objective = path_following(state.tip, desired)
    share = _share(state.tip.jacobian[:3], desired)
    return Task((objective,), (), _length(desired), share, compliance=_compliance(settings, PATH_REWARD))


def approach_path(state: ToolState, force: Array, towards: Array, settings: ControlSettings) -> Task:
    """The approach phase: the tip is guided onto the path at the hand's speed; ``towards`` (3,) leads to it."""
    desired = _guided(force, towards, settings)
    objective = path_following(state.tip, desired)
    share = _share(state.tip.jacobian[:3], desired)
    return Task((objective,), (), _length(desired), share, compliance=_compliance(settings, PATH_REWARD))


def approach_target(state: ToolState, tool: Tool, force: Array, target: Array, settings: ControlSettings) -> Task:
    """Approach of target inspection: the virtual point P_v is guided onto the target (3,) at the hand's speed."""
    jacobian, point = _view(state, tool, settings)
    desired = _guided(force, target - point, settings)
    objective, share = reach_target(jacobian, desired), _share(jacobian, desired)
    return Task((objective,), (), _length(desired), share, compliance=_compliance(settings, VIEW_REWARD))


def inspect_target(state: ToolState, tool: Tool, torque: Array, target: Array, settings: ControlSettings) -> Task:
    """Target inspection (eq. 22-25): the torque (3,) in N·mm swings the tool while P_v stays on the target."""
    jacobian, point = _view(state, tool, settings)
    lever = settings.view_distance_mm
    turn = settings.rotation_gain_rad_per_s_per_nmm * settings.dt_s * torque
    tolerance = settings.target_tolerance_mm
    offset = point - target

    def stays(after: ToolState) -> bool:
        end = view_point(after, tool, lever)
        return float(np.linalg.norm(end - target)) <= max(tolerance, float(np.linalg.norm(offset)))

    return Task(
        (swing(state.tip, turn, lever), centre_target(jacobian, offset)),
        (hold_target(jacobian, offset, tolerance),),
        lever * _length(turn),
        _share(state.tip.jacobian[3:], turn),
        stays,
        lever**2 * settings.rotation_gain_rad_per_s_per_nmm * settings.dt_s * progress_weight(VIEW_REWARD),
    )


def move_freely(state: ToolState, force: Array, torque: Array, settings: ControlSettings) -> Task:
    """Free cooperative motion: no path, the tool yields to the hand in every direction (k_τ = 1)."""
    desired = settings.gain_mm_per_s_per_n * settings.dt_s * force
    turn = settings.rotation_gain_rad_per_s_per_nmm * settings.dt_s * torque
    lever = settings.view_distance_mm
    wanted = np.concatenate([desired, lever * turn])
    rows = np.vstack([state.tip.jacobian[:3], lever * state.tip.jacobian[3:]])
    return Task((free_motion(state.tip, desired, turn, lever),), (), _length(wanted), _share(rows, wanted))


def view_point(state: ToolState, tool: Tool, distance: float) -> Array:
    """P_v (3,): the point ``distance`` mm ahead of the tip on the optical axis."""
    point: Array = state.tip.position + distance * tool.direction(state.tip.rotation)
    return point


def _view(state: ToolState, tool: Tool, settings: ControlSettings) -> tuple[Array, Array]:
    axis = tool.direction(state.tip.rotation)
    jacobian = view_jacobian(state.tip, settings.view_distance_mm, axis)
    return jacobian, view_point(state, tool, settings.view_distance_mm)


def _guided(force: Array, towards: Array, settings: ControlSettings) -> Array:
    """Step (3,) towards a goal that does not overshoot it."""
    step = approach_velocity(force, towards, gain=settings.gain_mm_per_s_per_n) * settings.dt_s
    return towards if step @ step > towards @ towards else step


def _compliance(settings: ControlSettings, reward: float) -> float:
    """What a newton is worth to objectives with a progress variable, in mm/N; see ``Situation``."""
    return settings.gain_mm_per_s_per_n * settings.dt_s * progress_weight(reward)


def _length(vector: Array) -> float:
    length = float(np.linalg.norm(vector))
    return length if length > _NOTHING_MM else 0.0


def _share(jacobian: Array, desired: Array) -> Callable[[Array], float]:
    """Part of the desired motion that a joint step makes along it."""
    size = float(desired @ desired)
    along = (desired @ jacobian) / size if size > 0.0 else np.zeros(jacobian.shape[1])
    return lambda step: float(along @ step)
