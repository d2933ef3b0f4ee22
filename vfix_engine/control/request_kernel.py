"""Task requests, compiled: from a packed state and the hand's command to objective rows over (Δq, λ).

A task that requests a motion ΔP_d with a progress variable λ has the rows ‖J Δq − λ ΔP_d‖² + w_λ² ‖ΔP_d‖² (1 − λ)²:
the desired motion, or the largest feasible fraction of it. Li 2007, eq. 14 requires (1 − ε_t) of the motion and is
infeasible as soon as the anatomy stops the tool; λ slows the tool down along the desired direction instead.

Every kernel takes ``task``, the packed ``TaskNumbers``; the sizes n, s, b of the packed state ``before``
(``fixtures.state_kernel``); and ``reach``, the longest motion in mm, or rad for a rotation.
It writes the objective rows ``matrix`` (m, n + 1) and ``target`` (m,), and ``motion_gain`` (n,), and returns the other
fields of a ``StepRequest``: length of the wanted step, whether it has a direction, compliance, ramp fraction.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled, shared
from ..kernels.packed import packed, packing
from ..kernels.triples import Triple, dot, minus, norm, over, plus, times
from ..kernels.views import view
from ..robots import Tool
from ..virtual_fixtures.polyhedra import BALL_DIRECTIONS
from ..virtual_fixtures.state_kernel import StateViews, state_views
from ..virtual_fixtures.stopping import approach_bound, stoppable_step
from .admittance import approach_velocity, path_velocity, saturate, slew_limited
from .settings import ControlSettings

Asked = tuple[float, bool, float, float]

# w_λ, the weight of progress against errors across the desired direction. A tenth along a path: where it is blocked,
# a hand that pushes along it causes only a small error across it.
PATH_REWARD, VIEW_REWARD = 0.1, 0.3
_NOTHING_MM = 1e-9  # a shorter wanted step counts as none
_LEVER_MM = 15.0  # lever of rotations for a virtual point at the tip
_TURNING_MM = 1e-6  # substitute for the step length while the velocity reverses


class TaskNumbers(NamedTuple):
    """Settings and tool dimensions that the tasks use; mm, rad, s, N.

    gain … tolerance, deceleration: settings of the same names; distance: of the virtual point P_v from the tip; lever:
    by which rotations are compared with displacements, the distance or ``_LEVER_MM`` where it is shorter than 1 mm.
    sight_speed: largest speed from which the tool stops within sight of anatomy; speed_change, turn_change: largest
    change of the desired velocity and angular velocity in one step; axis: optical axis, grip: point that the hand
    holds, both in the tip frame.
    """

    dt: Annotated[float, ()]
    gain: Annotated[float, ()]
    rotation_gain: Annotated[float, ()]
    k_d: Annotated[float, ()]
    k_tau: Annotated[float, ()]
    capture: Annotated[float, ()]
    distance: Annotated[float, ()]
    tolerance: Annotated[float, ()]
    deceleration: Annotated[float, ()]
    sight_speed: Annotated[float, ()]
    speed_change: Annotated[float, ()]
    turn_change: Annotated[float, ()]
    lever: Annotated[float, ()]
    axis: Annotated[Array, 3]
    grip: Annotated[Array, 3]


task_views = packing(TaskNumbers).views


def task_numbers(settings: ControlSettings, tool: Tool) -> Array:
    """Pack the numbers of settings and tool."""
    dt = settings.dt_s
    return packed(
        TaskNumbers(
            dt, settings.gain_mm_per_s_per_n, settings.rotation_gain_rad_per_s_per_nmm, settings.k_d, settings.k_tau,
            settings.capture_mm, settings.view_distance_mm, settings.target_tolerance_mm,
            settings.approach_deceleration_mm_per_s2, settings.sight_speed_mm_per_s,
            settings.acceleration_mm_per_s2 * dt, settings.turn_acceleration_rad_per_s2 * dt,
            settings.view_distance_mm if settings.view_distance_mm >= 1.0 else _LEVER_MM,
            tool.direction(np.eye(3)), tool.grip(np.eye(3), np.zeros(3)),
        )
    )  # fmt: skip


@compiled
def free_request(
    task: Array, n: int, s: int, b: int, before: Array, force: Triple, torque: Triple, reach: float,
    matrix: Array, target: Array, motion_gain: Array,
) -> Asked:  # fmt: skip
    """Rows ‖J_v Δq − ΔP_d‖² + lever² ‖J_ω Δq − Δθ_d‖² (Li 2007, eq. 4), m = 6; ``torque`` in N·mm about the tip."""
    t, state = task_views(task), state_views(before, n, s, b)
    push = saturate(times(t.gain, force), min(t.sight_speed, stoppable_speed(reach, t.speed_change, t.dt)))
    turn = saturate(times(t.rotation_gain, torque), sight_turn(state, t.sight_speed))
    # One fraction limits both: translation and rotation are compared as fractions of their allowed changes.
    per_speed, per_turn, lever = 1.0 / t.speed_change, 1.0 / t.turn_change, t.lever
    now = np.dot(state.jacobian, state.velocity)
    now_push, now_turn = times(per_speed, triple_at(now, 0)), times(per_turn, triple_at(now, 3))
    new_push, new_turn = times(per_speed, push), times(per_turn, turn)
    more_push, more_turn = minus(new_push, now_push), minus(new_turn, now_turn)
    ramp, size = 1.0, math.sqrt(_squared(more_push, more_turn))
    if not size <= 1.0:
        ramp = 1.0 / size
        new_push, new_turn = plus(now_push, times(ramp, more_push)), plus(now_turn, times(ramp, more_turn))
    step, angle = times(t.dt, over(new_push, per_speed)), times(t.dt, over(new_turn, per_turn))
    wanted, wish_angle = times(t.dt, push), times(t.dt, times(lever, turn))
    scaled, jacobian = times(lever, angle), np.empty((6, n))
    for k in range(3):
        target[k], target[3 + k] = step[k], scaled[k]
        for j in range(n):
            jacobian[k, j], jacobian[3 + k, j] = state.jacobian[k, j], lever * state.jacobian[3 + k, j]
    for k in range(6):
        matrix[k, n] = 0.0
        for j in range(n):
            matrix[k, j] = jacobian[k, j]
    square = _squared(step, scaled)
    length, moves = math.sqrt(square), square > _NOTHING_MM * _NOTHING_MM
    if moves:
        share = np.dot(target, jacobian)
        for j in range(n):
            motion_gain[j] = share[j] / square
    if not length > _NOTHING_MM:
        length = _turning(math.sqrt(_squared(wanted, wish_angle)), state.velocity)
    whole = math.sqrt(_squared(times(t.dt, times(per_speed, push)), times(t.dt, times(per_turn, turn))))
    fraction = 1.0
    if whole > 0.0:
        fraction = min(math.sqrt(_squared(times(per_speed, step), times(per_turn, angle))) / whole, 1.0)
    return length, moves, t.gain * t.dt * ramp, fraction


@compiled
def path_request(
    task: Array, n: int, s: int, b: int, before: Array, force: Triple, place: Triple, tangent: Triple,
    behind: float, ahead: float, reach: float, matrix: Array, target: Array, motion_gain: Array,
) -> Asked:  # fmt: skip
    """The tip follows a path (Li 2007, eq. 9-15), m = 4.

    Args:
        place, tangent: position and tangent of the path point closest to the tip; behind, ahead: remaining arc length
            in each direction, so that no step leaves the path at its ends.
    """
    t, state = task_views(task), state_views(before, n, s, b)
    wanted = path_velocity(
        force, tangent, minus(place, triple_at(state.position, 0)), t.gain, t.k_d, t.k_tau, t.capture
    )
    wanted = saturate(wanted, min(t.sight_speed, stoppable_speed(reach, t.speed_change, t.dt)))
    jacobian = view(state.jacobian, 0, (3, n))
    velocity, ramp = slew_limited(_velocity(jacobian, state.velocity), wanted, t.speed_change)
    forwards = dot(velocity, tangent)
    kept = min(
        max(forwards, -stoppable_speed(behind, t.speed_change, t.dt)), stoppable_speed(ahead, t.speed_change, t.dt)
    )
    desired = times(t.dt, plus(velocity, times(kept - forwards, tangent)))  # eq. 12
    _write_progress(jacobian, 1.0, desired, PATH_REWARD, matrix, target)  # eq. 13
    compliance = t.gain * t.dt * ramp * progress_weight(PATH_REWARD)
    return _asked(jacobian, desired, times(t.dt, wanted), state.velocity, compliance, motion_gain)


@compiled
def approach_request(
    task: Array, n: int, s: int, b: int, before: Array, force: Triple, goal: Triple, of_view: bool, reach: float,
    matrix: Array, target: Array, motion_gain: Array,
) -> Asked:  # fmt: skip
    """The tip, or with ``of_view`` the virtual point P_v, moves straight to ``goal`` and stops there, m = 4."""
    t, state = task_views(task), state_views(before, n, s, b)
    point, jacobian, reward = triple_at(state.position, 0), np.empty((3, n)), PATH_REWARD
    for k in range(3):
        for j in range(n):
            jacobian[k, j] = state.jacobian[k, j]
    if of_view:
        reward, point = VIEW_REWARD, view_place(t, state)
        _carry(state, point, jacobian)
    towards = minus(goal, point)
    remaining = min(norm(towards), reach)
    fastest = min(t.sight_speed, stoppable_speed(remaining, t.speed_change, t.dt))
    wanted = approach_velocity(force, towards, t.gain, fastest)
    velocity, ramp = slew_limited(_velocity(jacobian, state.velocity), wanted, t.speed_change)
    desired = times(t.dt, velocity)
    _write_progress(jacobian, 1.0, desired, reward, matrix, target)
    compliance = t.gain * t.dt * ramp * progress_weight(reward)
    return _asked(jacobian, desired, times(t.dt, wanted), state.velocity, compliance, motion_gain)


@compiled
def inspect_request(
    task: Array, n: int, s: int, b: int, before: Array, torque: Triple, goal: Triple, inner: float, reach: float,
    matrix: Array, target: Array, motion_gain: Array, planes: Array, bound: Array,
) -> Asked:  # fmt: skip
    """The rotation kτΔt of (24) with a progress variable, and ‖J Δq + (P_v − P_t)‖², m = 7.

    Inside the ball the centre is still preferred: the last three rows pull towards it.

    Args:
        torque: in N·mm; goal: P_t; inner: ``polyhedra.ball_inner``.
        planes, bound: out, (32, n + 1), (32,): ‖P_v + J Δq − P_t‖ ≤ ε_t as half-spaces of a polyhedron inside that ball
            (eq. 22-23); the virtual point can stop before each of them, and returns from beyond it.
    """
    t, state = task_views(task), state_views(before, n, s, b)
    wanted = times(t.rotation_gain, torque)
    fastest = min(sight_turn(state, t.sight_speed), stoppable_speed(reach, t.turn_change, t.dt))
    wanted = saturate(wanted, fastest)
    turning = view(state.jacobian, 3 * n, (3, n))
    spin, ramp = slew_limited(_velocity(turning, state.velocity), wanted, t.turn_change)
    turn, point, jacobian = times(t.dt, spin), view_place(t, state), np.empty((3, n))
    _write_progress(turning, t.lever, times(t.lever, turn), VIEW_REWARD, matrix, target)
    for k in range(3):
        for j in range(n):
            jacobian[k, j] = state.jacobian[k, j]
    _carry(state, point, jacobian)
    apart, offset = minus(point, goal), np.empty(3)
    for k in range(3):
        target[4 + k], matrix[4 + k, n], offset[k] = -apart[k], 0.0, apart[k]
        for j in range(n):
            matrix[4 + k, j] = jacobian[k, j]
    rows, slack = np.dot(BALL_DIRECTIONS, jacobian), np.dot(BALL_DIRECTIONS, offset)
    change = t.deceleration * t.dt * t.dt
    for i in range(len(bound)):
        bound[i], planes[i, n] = approach_bound(t.tolerance * inner - slack[i], change), 0.0
        for j in range(n):
            planes[i, j] = rows[i, j]
    compliance = t.lever * t.lever * t.rotation_gain * t.dt * ramp * progress_weight(VIEW_REWARD)
    length, moves, compliance, fraction = _asked(
        turning, turn, times(t.dt, wanted), state.velocity, compliance, motion_gain
    )
    return t.lever * length, moves, compliance, fraction


@compiled
def stays_in_view(task: Array, n: int, s: int, b: int, before: Array, after: Array, goal: Triple) -> bool:
    """Whether P_v ends in the ball of radius ε_t about P_t, or no further out than before."""
    t = task_views(task)
    error = norm(minus(view_place(t, state_views(after, n, s, b)), goal))
    admissible: bool = error <= max(t.tolerance, norm(minus(view_place(t, state_views(before, n, s, b)), goal)))
    return admissible


def load_requests(kernel_sizes: tuple[Array, int, int, int], before: Array) -> None:
    """Call every kernel once, because loading one at its first use would stop a running robot.

    Args:
        kernel_sizes: of a ``ControlContext``; before: packed state.
    """
    n, no = kernel_sizes[1], (0.0, 0.0, 0.0)
    matrix, target, motion_gain = np.empty((7, n + 1)), np.empty(7), np.empty(n)
    planes, bound = np.empty((len(BALL_DIRECTIONS), n + 1)), np.empty(len(BALL_DIRECTIONS))
    free_request(*kernel_sizes, before, no, no, math.inf, matrix[:6], target[:6], motion_gain)
    path_request(*kernel_sizes, before, no, no, no, 0.0, 0.0, math.inf, matrix, target, motion_gain)
    approach_request(*kernel_sizes, before, no, no, True, math.inf, matrix, target, motion_gain)
    inspect_request(*kernel_sizes, before, no, no, 1.0, math.inf, matrix, target, motion_gain, planes, bound)
    stays_in_view(*kernel_sizes, before, before, no)


@shared
def progress_weight(reward: float) -> float:
    """Cost of a missing fraction of the desired motion: w_λ² / (1 + w_λ²) with a progress variable, 1 without.

    For a motion x ΔP_d the optimal λ is (x + w_λ²) / (1 + w_λ²), which leaves ½ w_λ² / (1 + w_λ²) ‖ΔP_d‖² (1 − x)².
    """
    return reward * reward / (1.0 + reward * reward)


@shared
def _write_progress(
    jacobian: Array, lever: float, desired: Triple, reward: float, matrix: Array, target: Array
) -> None:
    """Write the four rows of a motion with a progress variable; ``lever`` converts rotation to displacement."""
    n = jacobian.shape[1]
    weight = reward * norm(desired)
    for k in range(3):
        target[k], matrix[k, n] = 0.0, -desired[k]
        for j in range(n):
            matrix[k, j] = lever * jacobian[k, j]  # eq. 13, with λ: ‖J Δq − λ ΔP_d‖²
    for j in range(n):
        matrix[3, j] = 0.0
    target[3] = matrix[3, n] = weight


@shared
def _asked(
    jacobian: Array, desired: Triple, wanted: Triple, velocity: Array, compliance: float, motion_gain: Array
) -> Asked:
    """Return a kernel's result for the motion ``desired``, an accelerating step towards the final step ``wanted``."""
    square = dot(desired, desired)
    moves = square > _NOTHING_MM * _NOTHING_MM
    if moves:
        for j in range(len(motion_gain)):
            column = jacobian[0, j], jacobian[1, j], jacobian[2, j]
            motion_gain[j] = dot(desired, column) / square
    length, whole = norm(desired), norm(wanted)
    fraction = min(length / whole, 1.0) if whole > 0.0 else 1.0
    if not length > _NOTHING_MM:
        length = _turning(whole, velocity)
    return length, moves, compliance, fraction


@shared
def _turning(wanted: float, velocity: Array) -> float:
    """Return the scale of a desired step of length 0; 0 only if no motion is wanted or no joint moves.

    A tool that moves against its hand, e.g. on its way out of a margin, has a desired velocity of 0 while it reverses.
    That is not rest: rows that require motion must stay active.
    """
    if wanted > _NOTHING_MM:
        for j in range(len(velocity)):
            if velocity[j] != 0.0:
                return _TURNING_MM
    return 0.0


@shared
def stoppable_speed(remaining: float, change: float, dt: float) -> float:
    """Largest speed from which the wanted motion stops within ``remaining``; change: of the speed in one step."""
    if not remaining < math.inf:
        return math.inf
    return stoppable_step(remaining, change * dt) / dt


@shared
def sight_turn(state: StateViews, sight_speed: float) -> float:
    """Largest angular speed about the tip at which every end of the tool can stop within sight."""
    farthest, tip = 0.0, triple_at(state.position, 0)
    for i in range(len(state.start)):
        for ends in (state.start, state.end):
            away = minus((ends[i, 0], ends[i, 1], ends[i, 2]), tip)
            farthest = max(farthest, dot(away, away))
    return sight_speed / max(math.sqrt(farthest), 1.0)


@shared
def view_place(t: TaskNumbers, state: StateViews) -> Triple:
    """Return P_v, the point ``distance`` ahead of the tip on the optical axis."""
    axis = np.dot(state.rotation, t.axis)
    return plus(triple_at(state.position, 0), times(t.distance, triple_at(axis, 0)))


@shared
def _carry(state: StateViews, point: Triple, jacobian: Array) -> None:
    """Transform the tip's Jacobian (3, n) to that of the tool's material point now at ``point``: J_v − r × J_ω."""
    r = minus(point, triple_at(state.position, 0))
    for j in range(jacobian.shape[1]):
        a, b, c = state.jacobian[3, j], state.jacobian[4, j], state.jacobian[5, j]
        # ω × r = −r × ω
        jacobian[0, j] -= r[1] * c - r[2] * b
        jacobian[1, j] -= r[2] * a - r[0] * c
        jacobian[2, j] -= r[0] * b - r[1] * a


@shared
def _velocity(jacobian: Array, velocity: Array) -> Triple:
    """Return J q̇ for a Jacobian (3, n)."""
    return triple_at(np.dot(jacobian, velocity), 0)


@shared
def triple_at(values: Array, first: int) -> Triple:
    return values[first], values[first + 1], values[first + 2]


@shared
def _squared(a: Triple, b: Triple) -> float:
    """Return the squared norm of a vector of six components, given as two triples."""
    return dot(a, a) + b[0] * b[0] + b[1] * b[1] + b[2] * b[2]
