"""Effect of a force on the grip, compiled: its torque about the moving point, and the position of that."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...control.request_kernel import TaskNumbers, task_views, triple_at, view_place
from ...kernels.compiled import compiled, shared
from ...kernels.triples import Triple, cross, minus, norm, plus, times
from ...virtual_fixtures.state_kernel import StateViews, state_views


@compiled
def torque_about_tip(
    task: Array, n: int, s: int, b: int, numbers: Array, force: Triple, twist: float
) -> Triple:  # fmt: skip
    """τ = (grip − tip) × f plus the twist about the shaft, in N·mm.

    Args:
        task, n, s, b: of ``ControlContext.kernel_sizes``; numbers: of the packed state; force: in N; twist: in N·mm.
    """
    state = state_views(numbers, n, s, b)
    return _torque(state, minus(_grip(task_views(task), state), triple_at(state.position, 0)), force, twist)


@compiled
def torque_about_view(
    task: Array, n: int, s: int, b: int, numbers: Array, force: Triple, twist: float, goal: Triple
) -> tuple[float, float, Triple]:
    """Distance from the virtual point P_v to a target, lever of the grip about P_v in mm, and the torque about P_v."""
    t, state = task_views(task), state_views(numbers, n, s, b)
    centre = view_place(t, state)
    lever = minus(_grip(t, state), centre)
    return norm(minus(centre, goal)), norm(lever), _torque(state, lever, force, twist)


@shared
def _grip(t: TaskNumbers, state: StateViews) -> Triple:
    """Position of the grip."""
    return plus(triple_at(np.dot(state.rotation, t.grip), 0), triple_at(state.position, 0))


@shared
def _torque(state: StateViews, lever: Triple, force: Triple, twist: float) -> Triple:
    torque = cross(lever, force)
    if twist != 0.0:
        torque = plus(torque, times(twist, (state.rotation[0, 1], state.rotation[1, 1], state.rotation[2, 1])))
    return torque
