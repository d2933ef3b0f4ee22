"""Common parts of the tasks that a hand drives: their context, and the request that is built from their rows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...geometry.shaft_directions import ShaftDirections
from ...virtual_fixtures import Constraint, Objective, StepState
from ..context import ControlContext, context_of
from ..request_kernel import Asked
from ..shaft_kernel import shaft_rows
from ..step_request import HandCommand, StepRequest


def context_for(task: object, state: StepState, command: HandCommand) -> ControlContext:
    """Return the context that measured the state.

    Raises:
        ControlError: there is none. InputError: the command is not a ``HandCommand``.
    """
    if not isinstance(command, HandCommand):
        raise InputError(f"{type(task).__name__} is driven by a HandCommand, not by {command!r:.60}")
    return context_of(state)


def request_with(
    matrix: Array,
    target: Array,
    motion_gain: Array,
    asked: Asked,
    constraints: tuple[Constraint, ...] = (),
    is_admissible: Callable[[StepState], bool] | None = None,
    more: tuple[Objective, ...] = (),
) -> StepRequest:
    """Build a request from a kernel's rows, see ``request_kernel``; ``more``: additional objectives."""
    length, moves, compliance, ramp_fraction = asked
    objectives = (Objective(matrix, target), *more)
    share = motion_gain if moves else None
    return StepRequest(objectives, constraints, length, share, is_admissible, compliance, ramp_fraction)


def shaft_objective(
    context: ControlContext, state: StepState, shaft: ShaftDirections, at: float, step: float, wanted: float
) -> tuple[Objective, ...]:
    """Objective that follows the planned orientation of the shaft; empty without a wanted motion.

    Args:
        at: arc length of the path point closest to the tip.
        step: length of the wanted motion along the path; wanted: its total length, mm.
    """
    if wanted <= 0.0:
        return ()
    matrix, target = np.empty((3, context.layout.dof + 1)), np.empty(3)
    shaft_rows(*context.kernel_sizes, state.numbers, *shaft.table, shaft.has_roll, at, step, wanted, matrix, target)
    return (Objective(matrix, target),)
