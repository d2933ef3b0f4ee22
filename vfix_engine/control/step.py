"""One control step in three functions: build the problem, solve it, certify the motion.

``problem = build_step(state, tasks, fixtures, command)``, ``solution = solve_step(problem)`` and
``verdict = certify_step(problem, solution.dq)`` are what ``Controller.step`` runs, with the relaxations of infeasible
programs in addition (``relaxations``).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..validate import real_array
from ..virtual_fixtures import Constraint, Fixture, Rows, Situation, StepState, brake
from . import qp
from .context import ControlContext, context_of
from .problem import Problem
from .program import Solution
from .step_request import StepRequest, Task, request_of

CERTIFICATE = "certificate"  # name of the verdict that refuses a motion that may touch anatomy or a zone
_STOPPING_MM = 1e-6  # substitute for the length of the wanted step while the tool decelerates to rest


@dataclass(frozen=True, eq=False)
class Certified:
    """The whole motion respects every margin, and every task and fixture admits its final state."""

    next_state: StepState


@dataclass(frozen=True, eq=False)
class Refused:
    """The motion must not be made. by: 'certificate', 'task', or the fixture that refuses its final state."""

    by: str | Fixture


def build_step(
    state: StepState,
    tasks: Task | Sequence[Task],
    fixtures: Sequence[Fixture] = (),
    command: Any = None,
    dt: float | None = None,
) -> Problem:
    """Build the problem of the step from ``state``.

    Anatomy, zones and joint limits belong to the context that measured the state: their rows and their checks are part
    of every problem.

    Args:
        state: from ``Controller.start``, ``ControlContext.measure``, or a previous step.
        tasks: what the tool does; their objectives share one progress variable.
        fixtures: active in every step; their rows are added to those of the tasks.
        command: passed to every task; tasks driven by a hand need a ``HandCommand``.
        dt: control period in s; optional, must equal that of the state's context.

    Returns:
        The problem; the next one that is built from a state of the same context overwrites its numbers.

    Raises:
        ControlError: the state was not measured by a ``ControlContext``.
        InputError: there is no task, its rows have wrong shapes, or dt differs from the context's.
    """
    context = context_of(state)
    if dt is not None and dt != context.settings.dt_s:
        raise InputError(f"dt is {dt!r} s, but the state was measured for steps of {context.settings.dt_s!r} s")
    return problem_of(state, tasks, fixtures, command)


def problem_of(
    state: StepState, tasks: Task | Sequence[Task], fixtures: Sequence[Fixture] = (), command: Any = None
) -> Problem:
    """``build_step`` for a state that is known to be measured by a context."""
    request = request_of(tasks, state, command)
    scale = request.scale
    if scale is None or scale <= 0.0:
        return _rest(state, request, fixtures)
    objectives, constraints = request.objectives, request.constraints
    if fixtures:
        standing = _rows(state, request, scale, fixtures)
        objectives = (*objectives, *(o for rows in standing for o in rows.objectives))
        constraints = (*constraints, *(c for rows in standing for c in rows.constraints))
    problem = Problem(state, request, fixtures, objectives, constraints and _inequalities(constraints), scale)
    problem.tasks = tasks
    return problem


def solve_step(problem: Problem, solver: str = qp.DUAL) -> Solution:
    """Solve the problem and check the Karush-Kuhn-Tucker conditions of its solution.

    Args:
        solver: 'dual' (built in), 'daqp', or any solver installed for qpsolvers, such as 'osqp'.

    Returns:
        The solution; if there is none, ``found`` is False, ``why`` gives the reason and reading ``dq`` raises.

    Raises:
        ControlError: the solver is not installed; or another problem was built since.
    """
    if problem.brakes:
        return Solution(braking(problem.state), 0.0, np.zeros(0), 0)
    if solver == qp.DUAL and (known := problem.found_solution()) is not None:
        return known
    found = qp.solve(problem.program, solver, problem.own_failed and solver == qp.DUAL)
    return found or Solution(np.zeros(0), 0.0, np.zeros(0), 0, "no point fulfils all rows and the optimality check")


def certify_step(problem: Problem, dq: ArrayLike) -> Certified | Refused:
    """Check the joint step dq (n,) in mm and rad, from any source.

    The certificate checks the whole motion, then every task and every fixture the state at its end.

    Raises:
        InputError: dq does not have n numbers.
    """
    step = real_array("the step", dq)
    if step.shape != problem.state.q.shape:
        raise InputError(f"the step has the shape {step.shape}; it must be {problem.state.q.shape}, one number a joint")
    after = problem.context.certify(problem.state, step)
    if after is None:
        return Refused(CERTIFICATE)
    by = refused_by(problem, after)
    return Certified(after) if by is None else Refused(by)


def refused_by(problem: Problem, after: StepState) -> str | Fixture | None:
    """Return the task or fixture that does not admit a certified state; None if all do."""
    verdict = problem.request.is_admissible
    if verdict is not None and not verdict(after):
        return "task"
    for fixture in problem.fixtures:
        if not verdict_of(fixture)(problem.state, after):
            return fixture
    return None


def verdict_of(fixture: Fixture) -> Callable[[StepState, StepState], bool]:
    """Return the fixture's ``is_admissible``, or ``keeps``, its name in earlier versions, with a DeprecationWarning.

    Raises:
        InputError: the fixture has neither.
    """
    verdict = getattr(fixture, "is_admissible", None)
    if verdict is None and (verdict := getattr(fixture, "keeps", None)) is not None:
        warnings.warn(f"{type(fixture).__name__}.keeps is is_admissible now", DeprecationWarning, stacklevel=2)
    if verdict is None:
        raise InputError(
            f"the fixture {type(fixture).__name__} has no is_admissible(before, after); one that never refuses a "
            "motion returns True there"
        )
    checked: Callable[[StepState, StepState], bool] = verdict
    return checked


def braking(state: StepState) -> Array:
    """Return the step (n,) that decelerates the robot within every limit of its joints."""
    if not state.velocity.any():
        return np.zeros(len(state.q))
    constants = state.context.constants
    step: Array = np.clip(brake(state.velocity, constants.acceleration, constants.dt), state.box[0], state.box[1])
    return step


def _rest(state: StepState, request: StepRequest, fixtures: Sequence[Fixture]) -> Problem:
    """Build the problem of a step without wanted motion: the tool stands still, or decelerates within all limits."""
    limits: tuple[Constraint, ...] = ()
    if fixtures and state.velocity.any():
        # Objectives and soft rows are omitted: without a hand the tool only decelerates.
        standing = _rows(state, request, 0.0, fixtures)
        limits = _inequalities(tuple(c for rows in standing for c in rows.constraints if c.penalty is None))
        if (state.distance >= state.context.constants.margin[:, None]).all():
            constraints = (*_inequalities(request.constraints), *limits)
            problem = Problem(state, request, fixtures, request.objectives, constraints, _STOPPING_MM)
            problem.rests = True
            return problem
    problem = Problem(state, request, fixtures, (), limits, 0.0)
    problem.rests = problem.brakes = True
    return problem


def _rows(state: StepState, request: StepRequest, scale: float, fixtures: Sequence[Fixture]) -> list[Rows]:
    """Collect the rows of the fixtures for this step."""
    context: ControlContext = state.context
    settings = context.settings
    compliance = settings.gain_mm_per_s_per_n * settings.dt_s if request.compliance is None else request.compliance
    now = Situation(
        state, state.named_pairs(), state.body, context.robot.robot, context.tool, settings.dt_s, scale, compliance,
        context.tree, settings.approach_deceleration_mm_per_s2,
    )  # fmt: skip
    standing = [fixture.rows(now) for fixture in fixtures]
    for fixture, rows in zip(fixtures, standing, strict=True):
        if not isinstance(rows, Rows):
            raise InputError(f"rows() of {type(fixture).__name__} returns a {type(rows).__name__}; it must return Rows")
    return standing


def _inequalities(constraints: Sequence[Constraint]) -> tuple[Constraint, ...]:
    """Convert each equality row to two inequalities."""
    return tuple([c.as_inequalities() if c.equality else c for c in constraints])
