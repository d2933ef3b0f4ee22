"""Rows that make the shaft follow its planned orientation while its tip moves along a path, compiled."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..geometry.shaft_directions import ShaftDirections
from ..geometry.shaft_kernels import axes_at, column, turn_between, turned
from ..kernels.compiled import compiled, shared
from ..kernels.triples import Triple, cross, dot, minus, norm, over, plus, times
from ..virtual_fixtures.state_kernel import state_views
from .admittance import saturate, slew_limited
from .request_kernel import sight_turn, stoppable_speed, task_views, triple_at

# Length that weights an angle in the objective while the tip moves at the requested speed. It shrinks with the tip's
# speed, so that an orientation that bone prevents slows the tip down but never stops it (docs/concepts.md).
SHAFT_LEVER_MM = 5.0
MOST_TURN_PER_MM = 0.1  # rad per mm of the tip's wanted motion: without wanted motion the shaft does not rotate


@compiled
def shaft_rows(
    task: Array, n: int, s: int, b: int, before: Array, stations: Array, frames: Array, twists: Array, has_roll: bool,
    at: float, step: float, wish: float, matrix: Array, target: Array,
) -> None:  # fmt: skip
    """Rows lever · (J_ω Δq − Δθ_d) about the axes across the shaft, and about the shaft if a roll is planned, m = 3.

    Δθ_d is the planned rotation along ``step`` plus the correction towards the plan, at a speed from which the tool can
    stop at the planned orientation.

    Args:
        stations, frames, twists: of ``ShaftDirections``; has_roll: False leaves the third row 0.
        at: arc length of the path point closest to the tip; step: length of the wanted motion along the path,
            and wish: its total length, above 0, mm.
        matrix, target: out, (3, n + 1) and (3,).
    """
    t, state = task_views(task), state_views(before, n, s, b)
    x, y, z = column(state.rotation, 0), column(state.rotation, 1), column(state.rotation, 2)
    y_now, z_now = axes_at(stations, frames, twists, at)
    y_next, z_next = axes_at(stations, frames, twists, at + step)
    planned = over(_turn(y_now, z_now, y_next, z_next, has_roll), t.dt)
    back = _turn(y, z, y_now, z_now, has_roll)
    way = norm(back)
    if way > 0.0:
        back = times(min(stoppable_speed(way, t.turn_change, t.dt), way / t.dt) / way, back)
    wanted = plus(planned, back)
    roll = dot(wanted, y)
    fastest = MOST_TURN_PER_MM * wish / t.dt
    across = saturate(minus(wanted, times(roll, y)), min(sight_turn(state, t.sight_speed), fastest))
    wanted = plus(across, times(min(max(roll, -fastest), fastest), y))
    moving = np.dot(state.jacobian, state.velocity)
    turning = triple_at(moving, 3)
    if not has_roll:
        turning = minus(turning, times(dot(turning, y), y))
    spin, _ = slew_limited(turning, wanted, t.turn_change)
    lever = SHAFT_LEVER_MM * min(norm(triple_at(moving, 0)) * t.dt / wish, 1.0)
    angle = times(lever * t.dt, spin)
    _write(0, x, lever, angle, state.jacobian, matrix, target)
    _write(1, z, lever, angle, state.jacobian, matrix, target)
    _write(2, y if has_roll else (0.0, 0.0, 0.0), lever, angle, state.jacobian, matrix, target)


@shared
def _turn(y: Triple, z: Triple, onto_y: Triple, onto_z: Triple, with_roll: bool) -> Triple:
    """Rotation vector in rad from one pair of axes to another: first of the shaft, then about it."""
    axis, angle = turn_between(y, onto_y, z)
    turn = times(angle, axis)
    if not with_roll:
        return turn
    carried = turned(z, axis, angle)
    return plus(turn, times(np.arctan2(dot(cross(carried, onto_z), onto_y), dot(carried, onto_z)), y))


@shared
def _write(row: int, about: Triple, lever: float, angle: Triple, jacobian: Array, matrix: Array, target: Array) -> None:
    """Write one row of the rotation about a unit vector; ``angle`` is lever · Δθ_d."""
    n = jacobian.shape[1]
    target[row], matrix[row, n] = dot(about, angle), 0.0
    for j in range(n):
        spin = about[0] * jacobian[3, j] + about[1] * jacobian[4, j] + about[2] * jacobian[5, j]
        matrix[row, j] = lever * spin


def load_shaft_rows(kernel_sizes: tuple[Array, int, int, int], before: Array) -> None:
    """Call the kernel once, see ``request_kernel.load_requests``."""
    plan, n = ShaftDirections(np.zeros(1), np.eye(1, 3)), kernel_sizes[1]
    shaft_rows(*kernel_sizes, before, *plan.table, False, 0.0, 0.0, 1.0, np.empty((3, n + 1)), np.empty(3))
