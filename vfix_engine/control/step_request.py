"""The request of a task for one control step, and the protocol of a task."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any, Protocol

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..validate import real_array
from ..virtual_fixtures import Constraint, Objective, StepState

_FLOAT = np.dtype(np.float64)


def _zero() -> Array:
    return np.zeros(3)


def _is_vector(value: Any) -> bool:
    """Whether the value is a float array of three finite numbers."""
    if type(value) is not np.ndarray or value.dtype is not _FLOAT or value.shape != (3,):
        return False
    x, y, z = value.tolist()
    return math.isfinite(x) and math.isfinite(y) and math.isfinite(z)


@dataclass(frozen=True, eq=False)
class HandCommand:
    """Input of the hand in one step; patient frame.

    force: (3,) in N, already limited; torque: (3,) in N·mm about the point that the task moves.
    reach: longest motion, in mm of the point or rad of the rotation that the task controls; in teleoperation the
        distance by which the leader is ahead.

    Raises:
        InputError: force or torque is not three finite numbers, or the reach is not a number ≥ 0.
    """

    force: Array = field(default_factory=_zero)
    torque: Array = field(default_factory=_zero)
    reach: float = math.inf

    def __post_init__(self) -> None:
        if _is_vector(self.force) and _is_vector(self.torque) and type(self.reach) is float and self.reach >= 0.0:
            return
        for name, unit in (("force", "N"), ("torque", "N·mm")):
            vector = real_array(f"the {name}", getattr(self, name))
            if not _is_vector(vector):
                raise InputError(f"the {name} is {vector.tolist()!r:.60}; it is three finite numbers in {unit}")
            object.__setattr__(self, name, vector)
        reach: Any = self.reach
        if isinstance(reach, bool) or not isinstance(reach, Real) or not float(reach) >= 0.0:
            raise InputError(f"the reach is {reach!r:.60}; it is a number from 0 on")
        object.__setattr__(self, "reach", float(reach))


@dataclass(frozen=True, eq=False)
class StepRequest:
    """Rows of one step and their properties; only ``objectives`` is mandatory.

    objectives, constraints: rows over x = (Δq, λ), without those of the fixtures, the boundary and the joints.
    scale: length L of the wanted step in mm; 0: no motion is wanted, the tool decelerates to rest.
        None: the length of the weighted targets, ‖√w b‖ over all objective rows.
    motion_gain: (n,) fraction of the wanted motion per unit of each joint's motion; a step that achieves little of it
        is reported as held. None: derived from the rows without progress variable, Σ w bᵀA / Σ w bᵀb.
    is_admissible: check of the predicted state; False refuses the step. None: no check.
    compliance: in mm/N, see ``Situation``; None: gain · dt, for objectives that weight the tip's motion by 1.
    ramp_fraction: the wanted motion as a fraction of the hand's request, which it reaches at a bounded acceleration.

    A request is itself a task, which is independent of the state.
    """

    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...] = ()
    scale: float | None = None
    motion_gain: Array | None = None
    is_admissible: Callable[[StepState], bool] | None = None
    compliance: float | None = None
    ramp_fraction: float = 1.0

    def request(self, state: StepState, command: Any) -> StepRequest:
        """Return this request."""
        return self


class Task(Protocol):
    """What the tool does: an immutable object that requests rows step by step.

    Everything that changes between two steps is in the state or in the command, so that a step can be repeated.
    """

    def request(self, state: StepState, command: Any) -> StepRequest:
        """Return the request for the step from ``state`` under ``command``, usually a ``HandCommand``."""


def request_of(tasks: Task | Sequence[Task], state: StepState, command: Any) -> StepRequest:
    """Combine one or several tasks into one request with a known scale.

    The objectives and constraints of all tasks act together and share one progress variable λ.
    The scale is the largest one; properties of a single task, such as ``motion_gain``, are those of the first task that
    has them.

    Raises:
        InputError: there is no task, or a task returns something other than a ``StepRequest``.
    """
    if isinstance(tasks, (list, tuple)):
        if not tasks:
            raise InputError("a step needs at least one task")
        if len(tasks) > 1:
            return joined([_asked(task, state, command) for task in tasks])
        tasks = tasks[0]
    return _asked(tasks, state, command)


def _asked(task: Any, state: StepState, command: Any) -> StepRequest:
    if isinstance(task, type):
        raise InputError(f"{task.__name__} is a class and no task: make one of it, such as {task.__name__}(…)")
    ask = getattr(task, "request", None)
    if ask is None:
        raise InputError(f"a {type(task).__name__} is no task: it has no request(state, command)")
    return completed(ask(state, command))


def completed(request: StepRequest) -> StepRequest:
    """Fill in the scale and motion gain that the rows imply where the request has none."""
    if not isinstance(request, StepRequest):
        raise InputError(f"a task's request is a {type(request).__name__}; it must be a StepRequest")
    if isinstance(request.objectives, Objective):
        raise InputError("the objectives of a request are a tuple: StepRequest((objective,))")
    if request.scale is not None:
        return request
    columns = np.shape(request.objectives[0].matrix)[1:] if request.objectives else ()
    for o in request.objectives:
        if len(columns) != 1 or np.shape(o.matrix) != (*np.shape(o.target), *columns):
            raise InputError(
                f"an objective has a matrix {np.shape(o.matrix)} and a target {np.shape(o.target)}; "
                "m rows over n joints and the progress variable need (m, n + 1) and (m,)"
            )
    rows = [replace(o, matrix=np.asarray(o.matrix), target=np.asarray(o.target)) for o in request.objectives]
    objectives = [o for o in rows if len(o.target) and not np.any(o.matrix[:, -1])]
    size = sum(o.weight * float(o.target @ o.target) for o in objectives)
    whole = sum(o.weight * float(o.target @ o.target) for o in rows)
    motion_gain = request.motion_gain
    if motion_gain is None and 0.0 < size < math.inf:
        motion_gain = np.sum([o.weight * (o.target @ o.matrix[:, :-1]) for o in objectives], axis=0) / size
    return replace(request, scale=float(np.sqrt(whole)), motion_gain=motion_gain)


def joined(requests: Sequence[StepRequest]) -> StepRequest:
    """Join several completed requests into one, see ``request_of``."""
    verdicts = [r.is_admissible for r in requests if r.is_admissible is not None]
    return StepRequest(
        tuple(o for r in requests for o in r.objectives),
        tuple(c for r in requests for c in r.constraints),
        max(r.scale or 0.0 for r in requests),
        next((r.motion_gain for r in requests if r.motion_gain is not None), None),
        (lambda after: all(verdict(after) for verdict in verdicts)) if verdicts else None,
        next((r.compliance for r in requests if r.compliance is not None), None),
        min(r.ramp_fraction for r in requests),
    )
