"""Target inspection: the virtual point ahead of the tip reaches a target, then the tool rotates about it (Li 2007)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...kernels.triples import Triple, triple
from ...robots import Tool
from ...validate import point
from ...virtual_fixtures import Constraint, StepState
from ...virtual_fixtures.polyhedra import BALL_DIRECTIONS, ball_inner
from ..context import ControlContext
from ..request_kernel import approach_request, inspect_request, stays_in_view
from ..step_request import HandCommand, StepRequest
from .hand_request import context_for, request_with

_PLANES = np.arange(len(BALL_DIRECTIONS))
_PLANES.setflags(write=False)


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
        """Return four objective rows in mm with a progress variable; ``command.torque`` is not used."""
        context = context_for(self, state, command)
        dof = context.layout.dof
        matrix, target, motion_gain = np.empty((4, dof + 1)), np.empty(4), np.empty(dof)
        asked = approach_request(
            *context.kernel_sizes, state.numbers, triple(command.force), triple(np.asarray(self.target)), True,
            command.reach, matrix, target, motion_gain,
        )  # fmt: skip
        return request_with(matrix, target, motion_gain, asked)


@dataclass(frozen=True, eq=False)
class InspectTarget:
    """The virtual point stays on a target while the hand's torque rotates the tool about it (eq. 22-25).

    Args:
        target: (3,) in the patient frame, mm.
    """

    target: ArrayLike

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", point("the target", self.target))

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        """Return seven objective rows and 32 planes in mm, and their check.

        ``command.force`` is not used, ``reach`` is in rad.
        """
        context, goal = context_for(self, state, command), triple(np.asarray(self.target))
        dof, count = context.layout.dof, len(_PLANES)
        matrix, target, motion_gain = np.empty((7, dof + 1)), np.empty(7), np.empty(dof)
        planes, bound = np.empty((count, dof + 1)), np.empty(count)
        asked = inspect_request(
            *context.kernel_sizes, state.numbers, triple(command.torque), goal, ball_inner(), command.reach,
            matrix, target, motion_gain, planes, bound,
        )  # fmt: skip
        constraints = (Constraint("target", planes, bound, _PLANES),)
        return request_with(
            matrix, target, motion_gain, asked, constraints, partial(_is_admissible, context, state, goal)
        )


def _is_admissible(context: ControlContext, before: StepState, goal: Triple, after: StepState) -> bool:
    """Whether the virtual point ends within the tolerance, or no further out than before."""
    return stays_in_view(*context.kernel_sizes, before.numbers, after.numbers, goal)


def view_point(state: StepState, tool: Tool, distance: float) -> Array:
    """Return P_v (3,): the point ``distance`` mm ahead of the tip on the optical axis."""
    point: Array = state.tip.position + distance * tool.direction(state.tip.rotation)
    return point
