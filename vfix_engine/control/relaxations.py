"""What a step tries when its program has no answer, as a table; and how much of an answer is made.

Where ``as_is`` has no answer, a retreat out of a margin is made as far as the accelerations allow (``relax_retreat``).
Where braking within the accelerations is not enough, keeping the distance comes first (``drop_acceleration``).
Walls on opposite sides may leave no slack for the buffer: then standing still must be allowed (``allow_hold``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..arrays import Array
from ..virtual_fixtures import StepState, joint_bounds
from . import qp
from .blockers import LimitingConstraint, active_constraints, nearest, unsolved
from .problem import Problem
from .program import Solution
from .step import Certified, Refused, braking, certify_step, refused_by, solve_step
from .step_report import StepReport

SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step that are tried before holding
MARGIN_SHARES = (0.03, 0.01)  # and inside a margin, where the bound between two poses leaves only its tolerance
HELD_SHARE = 0.02  # a step that achieves less of the wanted motion than this counts as held
SLOWED_SHARE = 0.9  # a step that achieves less of it is explained
_ROUNDING = 1e-9  # share of an acceleration limit that is the last bits of a velocity


@dataclass(frozen=True)
class Relaxation:
    """One way to state a step; base: the one that it is made from; gentle: every acceleration limit is kept."""

    name: str
    base: str | None
    change: Callable[[Problem], Problem]
    gentle: bool


def _as_is(problem: Problem) -> Problem:
    return problem


def _relax_retreat(problem: Problem) -> Problem:
    """The rows of the pairs may be missed, at a price, as far as standing still misses them."""
    program = problem.program
    return problem.changed(program.holdable(len(program.rows) - len(problem.state.pairs)))


def _drop_acceleration(problem: Problem) -> Problem:
    """Range and speed of the joints hold, no limit on acceleration."""
    problem = problem.without("acceleration")
    low, high = joint_bounds(problem.context.robot.robot, problem.state.q, problem.context.constants.dt)
    return problem.changed(problem.program.boxed(low, high), box=np.stack([low, high]))


def _allow_hold(problem: Problem) -> Problem:
    """Every row may be missed, at a price, as far as standing still misses it."""
    return problem.changed(problem.program.holdable())


RELAXATIONS = (
    Relaxation("as_is", None, _as_is, gentle=True),
    Relaxation("relax_retreat", "as_is", _relax_retreat, gentle=True),
    Relaxation("drop_acceleration", "as_is", _drop_acceleration, gentle=False),
    Relaxation("allow_hold", "drop_acceleration", _allow_hold, gentle=False),
)


def take_step(problem: Problem, solver: str, fused: bool = True) -> StepReport:
    """Solve and certify a problem, relaxed where it must be; what cannot be certified is held (HAZ-01, HAZ-03).

    Args:
        fused: the usual course of things in one compiled call; the result is the same without.
    """
    if problem.brakes:
        return _brake(problem)
    if not problem.scale < np.inf:
        return _held(problem, (unsolved(problem),), 0)
    if fused and solver == qp.DUAL and not problem.joined[1].soft:
        after = problem.fused_step()
        if after is not None and refused_by(problem, after) is None:
            return _moved_whole(problem, after)
    made: dict[str, Problem] = {}
    for relaxation in RELAXATIONS:
        base = problem if relaxation.base is None else made[relaxation.base]
        attempt = made[relaxation.name] = relaxation.change(base)
        solution = solve_step(attempt, solver)
        if solution.found:
            return _largest_share(attempt, solution, relaxation.gentle, problem)
    return _held(problem, (unsolved(problem),), attempt.row_count)


def _largest_share(attempt: Problem, solution: Solution, gentle: bool, problem: Problem) -> StepReport:
    """The largest certified share of the solution's step; ``problem``: the step as it was stated."""
    state, dq = attempt.state, solution.step
    inside = bool((state.distance < attempt.context.constants.margin[:, None]).any())
    shares = (*SHARES, *MARGIN_SHARES) if inside else SHARES
    for share in shares[1:] if attempt.full_refused else shares:
        step = dq
        if share < 1.0:  # less of a step is more of braking, not of halting: it keeps the accelerations
            slow = braking(state)
            step = slow + share * (dq - slow)
        verdict = certify_step(attempt, step)
        if isinstance(verdict, Certified):
            return _moved(attempt, verdict.next_state, _achieved(attempt, step), share, solution, step, gentle, problem)
    why, _ = _why(attempt, solution)
    return _held(problem, why or _refusing(verdict), attempt.row_count)


def _moved_whole(problem: Problem, after: StepState) -> StepReport:
    """The report of the fused kernel's step, as it goes nearly always: nothing slows it and nothing has to give way."""
    request, state = problem.request, problem.state
    share = 1.0 if request.motion_gain is None else problem.share
    if share < SLOWED_SHARE or problem.rests or state.numbers[state.layout.broken_place]:
        return _moved(problem, after, problem.share, 1.0, None)
    # Without the keywords and defaults of a call, which take as long as everything else here.
    return tuple.__new__(
        StepReport,
        (after, "moved", share, (), problem.row_count, False, partial(_explained, problem), request.ramp_fraction),
    )


def _explained(problem: Problem) -> tuple[LimitingConstraint, ...]:
    return _why(problem, None)[0]


def _moved(
    attempt: Problem,
    after: StepState,
    achieved: float,
    share: float,
    solution: Solution | None,
    step: Array | None = None,
    gentle: bool = True,
    problem: Problem | None = None,
) -> StepReport:
    """The report of a certified step; ``solution`` None: it is still in the workspace, as the fused kernel left it."""
    request, whole, state = attempt.request, share == 1.0 and gentle, attempt.state
    broken = state.numbers[state.layout.broken_place]
    emergency = False
    if broken or not whole:
        made = attempt.found_step() if step is None else step
        emergency = exceeds_acceleration(attempt if problem is None else problem, made, with_rows=not whole)
    if request.motion_gain is None or attempt.rests:
        achieved = 1.0

    def explain() -> tuple[LimitingConstraint, ...]:
        return _why(attempt, solution)[0]

    why: tuple[LimitingConstraint, ...] = ()
    outcome = "moved" if share == 1.0 else "shrunk"
    if achieved < SLOWED_SHARE:
        why, gathering = _why(attempt, solution)
        # A robot that gathers speed is not held, however little it makes of its first step.
        if achieved < HELD_SHARE and (why or not gathering):
            outcome, why = "held", why or nearest(attempt.state)
    report = StepReport(after, outcome, achieved, why, attempt.row_count, emergency, explain, request.ramp_fraction)
    return _idle(report) if attempt.rests else report


def _refusing(verdict: Certified | Refused) -> tuple[LimitingConstraint, ...]:
    """The fixture that does not admit where a motion ends, by the words of its rows; nothing where it is another."""
    by = None if isinstance(verdict, Certified) else verdict.by
    words = getattr(by, "words", "")
    return (LimitingConstraint("fixture", words=words),) if words else ()


def _held(problem: Problem, why: tuple[LimitingConstraint, ...], rows: int) -> StepReport:
    """The tool stays where it is."""
    state = problem.state
    emergency = exceeds_acceleration(problem, np.zeros(len(state.q)))
    report = StepReport(_stopped(state), "held", 0.0, why or nearest(state), rows, emergency)
    return _idle(report) if problem.rests else report


def _idle(report: StepReport) -> StepReport:
    return report._replace(outcome="idle", share=1.0, blockers=(), explain=tuple)


def _brake(problem: Problem) -> StepReport:
    """A robot that nobody drives comes to rest: the largest certified share of the braking step."""
    state = problem.state
    if not state.velocity.any():
        return StepReport(state, "idle", 1.0, (), 0)
    step = solve_step(problem).dq
    for share in SHARES:
        verdict = certify_step(problem, share * step)
        if isinstance(verdict, Certified):
            emergency = exceeds_acceleration(problem, share * step)
            return StepReport(verdict.next_state, "idle", 1.0, (), 0, emergency)
    return StepReport(_stopped(state), "idle", 1.0, (), 0, exceeds_acceleration(problem, 0.0 * step))


def _stopped(state: StepState) -> StepState:
    """The same pose at rest."""
    stopped: StepState = state.context.measure(state.q) if state.velocity.any() else state
    return stopped


def _why(attempt: Problem, solution: Solution | None) -> tuple[tuple[LimitingConstraint, ...], bool]:
    """What acts on a step, but for accelerations; and whether those do as well."""
    found = attempt.found_solution() if solution is None else solution
    every = () if found is None else active_constraints(attempt, found)
    why = tuple(b for b in every if b.kind != "acceleration")
    return why, len(why) < len(every)


def _achieved(attempt: Problem, step: Array) -> float:
    """The part of the wanted motion that a step makes, summed in the order of the fused kernel."""
    share = 0.0
    for part, motion in zip(attempt.motion_gain.tolist(), step.tolist(), strict=True):
        share += part * motion
    return share


def exceeds_acceleration(problem: Problem, step: Array, with_rows: bool = True) -> bool:
    """Whether a step exceeds an acceleration limit: of a joint, or of a constraint (``with_rows``)."""
    constants = problem.context.constants
    last, change = problem.state.velocity * constants.dt, constants.acceleration * constants.dt**2
    if (np.abs(step - last) > change + _ROUNDING * (change + np.abs(last))).any():
        return True
    return with_rows and any(
        (c.matrix[:, :-1] @ step > c.bound + _ROUNDING * np.abs(c.bound).max()).any()
        for c in problem.constraints
        if c.kind == "acceleration"
    )
