"""Relaxations of a step whose program has no solution, as a table; and the fraction of a solution that is made.

If ``as_is`` has no solution, a retreat out of a margin is limited to what the accelerations allow (``relax_retreat``).
If braking within the accelerations does not suffice, keeping the distance has priority (``drop_acceleration``).
Walls on opposite sides can leave no room for the buffer: then standing still must be feasible (``allow_hold``).
"""

from __future__ import annotations

import math
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

SHARES = (1.0, 0.5, 0.25, 0.1)  # fractions of a step that are tried before holding
MARGIN_SHARES = (0.03, 0.01)  # more inside a margin, where the bound between two poses leaves only its tolerance
HELD_SHARE = 0.02  # a step that achieves a smaller fraction of the wanted motion counts as held
SLOWED_SHARE = 0.9  # a step that achieves a smaller fraction is explained
_ROUNDING = 1e-9  # tolerance of an acceleration limit for rounding of the velocity, relative


@dataclass(frozen=True)
class Relaxation:
    """One variant of a step; base: the variant it derives from; gentle: every acceleration limit still holds."""

    name: str
    base: str | None
    change: Callable[[Problem], Problem]
    gentle: bool


def _as_is(problem: Problem) -> Problem:
    return problem


def _relax_retreat(problem: Problem) -> Problem:
    """Soften the rows of the pairs, at a cost, up to the values at which standing still is feasible."""
    program = problem.program
    return problem.changed(program.holdable(len(program.rows) - len(problem.state.pairs)))


def _drop_acceleration(problem: Problem) -> Problem:
    """Keep range and speed limits of the joints, drop their acceleration limits."""
    problem = problem.without("acceleration")
    low, high = joint_bounds(problem.context.robot.robot, problem.state.q, problem.context.constants.dt)
    return problem.changed(problem.program.boxed(low, high), box=np.stack([low, high]))


def _allow_hold(problem: Problem) -> Problem:
    """Soften every row, at a cost, up to the value at which standing still is feasible."""
    return problem.changed(problem.program.holdable())


RELAXATIONS = (
    Relaxation("as_is", None, _as_is, gentle=True),
    Relaxation("relax_retreat", "as_is", _relax_retreat, gentle=True),
    Relaxation("drop_acceleration", "as_is", _drop_acceleration, gentle=False),
    Relaxation("allow_hold", "drop_acceleration", _allow_hold, gentle=False),
)


def take_step(problem: Problem, solver: str, fused: bool = True) -> StepReport:
    """Solve and certify a problem, relaxed if necessary; hold where no motion can be certified (HAZ-01, HAZ-03).

    Args:
        fused: try one compiled call first, which covers the usual case; the result is the same without.
    """
    if problem.brakes:
        return _brake(problem)
    if not problem.scale < math.inf:
        return _held(problem, (unsolved(problem),), 0)
    if fused and solver == qp.DUAL:
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
    """Report the largest certified fraction of the solution's step; ``problem``: the step before relaxation."""
    state, dq = attempt.state, solution.step
    inside = bool((state.distance < attempt.context.constants.margin[:, None]).any())
    shares = (*SHARES, *MARGIN_SHARES) if inside else SHARES
    for share in shares[1:] if attempt.full_refused else shares:
        step = dq
        if share < 1.0:  # a fraction of the step must brake within the accelerations, not stop abruptly
            slow = braking(state)
            step = slow + share * (dq - slow)
        verdict = certify_step(attempt, step)
        if isinstance(verdict, Certified):
            return _moved(attempt, verdict.next_state, _achieved(attempt, step), share, solution, step, gentle, problem)
    why, _ = _why(attempt, solution)
    return _held(problem, why or _refusing(verdict), attempt.row_count)


def _moved_whole(problem: Problem, after: StepState) -> StepReport:
    """Report the fused kernel's full step, the usual case: nothing slows it and nothing is relaxed."""
    request = problem.request
    share = 1.0 if request.motion_gain is None else problem.share
    if share < SLOWED_SHARE or problem.rests or problem.broken:
        return _moved(problem, after, problem.share, 1.0, None)
    # Bypasses the keyword and default handling of a call, which takes as long as the rest of this function.
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
    """Report a certified step; ``solution`` None: it is still in the fused kernel's workspace."""
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
        # An accelerating robot is not held, however small the fraction of its first step.
        if achieved < HELD_SHARE and (why or not gathering):
            outcome, why = "held", why or nearest(attempt.state)
    report = StepReport(after, outcome, achieved, why, attempt.row_count, emergency, explain, request.ramp_fraction)
    return _idle(report) if attempt.rests else report


def _refusing(verdict: Certified | Refused) -> tuple[LimitingConstraint, ...]:
    """Describe the fixture that does not admit the final state by the words of its rows; empty if none is at fault."""
    by = None if isinstance(verdict, Certified) else verdict.by
    words = getattr(by, "words", "")
    return (LimitingConstraint("fixture", words=words),) if words else ()


def _held(problem: Problem, why: tuple[LimitingConstraint, ...], rows: int) -> StepReport:
    """Report that the tool stays in place."""
    state = problem.state
    emergency = exceeds_acceleration(problem, np.zeros(len(state.q)))
    report = StepReport(_stopped(state), "held", 0.0, why or nearest(state), rows, emergency)
    return _idle(report) if problem.rests else report


def _idle(report: StepReport) -> StepReport:
    return report._replace(outcome="idle", share=1.0, blockers=(), explain=tuple)


def _brake(problem: Problem) -> StepReport:
    """Decelerate a robot without a hand on it: the largest certified fraction of the braking step."""
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
    """Return the same pose with zero velocity."""
    stopped: StepState = state.context.measure(state.q) if state.velocity.any() else state
    return stopped


def _why(attempt: Problem, solution: Solution | None) -> tuple[tuple[LimitingConstraint, ...], bool]:
    """Return the constraints that limit a step except accelerations, and whether accelerations limit it too."""
    found = attempt.found_solution() if solution is None else solution
    every = () if found is None else active_constraints(attempt, found)
    why = tuple(b for b in every if b.kind != "acceleration")
    return why, len(why) < len(every)


def _achieved(attempt: Problem, step: Array) -> float:
    """Return the achieved fraction of the wanted motion, summed in the order of the fused kernel."""
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
