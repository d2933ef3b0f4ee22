"""The parts of the compiled step one by one: what each takes, and what it takes at the very least.

A part is called from Python at poses of the drive, a few times, and what handing over its arguments costs is taken off
again (the same call that repeats the part zero times).
Its floor is the same kernel repeated inside compiled code: everything in the fastest cache, nothing handed over.
What a step takes in the drive beyond the sum of its parts, code and data being no longer in the nearest caches when its
turn comes, is told as 'from_caches'.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from vfix_engine.certificate.certify_kernel import certify_motion
from vfix_engine.certificate.constants import unpack_candidates, unpack_constants
from vfix_engine.certificate.measure_kernel import measure, place
from vfix_engine.control import Controller, StepRequest, StepState, qp
from vfix_engine.control.dual_kernel import solve_dual
from vfix_engine.control.problem_kernel import DUAL_TOLERANCE, PRIMAL_TOLERANCE, check_kkt, prepare
from vfix_engine.control.step_kernel import answer_size, answer_views, fused_step, program_size, program_views
from vfix_engine.kernels.array_table import table_of
from vfix_engine.proximity.pairs import MAX_ROWS
from vfix_engine.virtual_fixtures.state_kernel import state_views

PARTS = ("kinematics", "proximity", "rows", "qp", "certificate")
REPEATS = 20  # of a kernel for its floor
CALLS = 7  # of a part, of which the median counts; the first is not counted


def _bare(function: Any) -> Any:
    return numba.njit(error_model="numpy")(function)


def _repeated(kernel: Any) -> Any:
    """The kernel so many times over in compiled code; the number of times is the first argument."""

    def repeated(times, *arguments):  # type: ignore[no-untyped-def]
        for _ in range(times):
            kernel(*arguments)

    return _bare(repeated)


@_bare
def _nothing(*_):  # type: ignore[no-untyped-def]
    return 0


@_bare
def _kinematics(times, numbers, counts, after):  # type: ignore[no-untyped-def]
    constants = unpack_constants(numbers, counts)
    s = state_views(after, len(constants.lower), len(constants.radius), len(constants.margin))
    for _ in range(times):
        place(constants, s.q, s.position, s.rotation, s.jacobian, s.start, s.end)


@_bare
def _proximity(times, numbers, counts, candidate_arrays, after, rows, labels, body):  # type: ignore[no-untyped-def]
    constants = unpack_constants(numbers, counts)
    candidates = unpack_candidates(len(constants.radius), *candidate_arrays)
    s = state_views(after, len(constants.lower), len(constants.radius), len(constants.margin))
    for _ in range(times):
        measure(constants, candidates, s.start, s.end, constants.threshold, s.distance, rows, labels, body)


@_bare
def _solve(hessian, gradient, rows, upper, lower, x, multiplier):  # type: ignore[no-untyped-def]
    solve_dual(hessian, gradient, rows, upper, lower, x, multiplier)
    check_kkt(hessian, gradient, rows, upper, lower, x, multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE)


_rows, _qp, _certify = (_repeated(kernel) for kernel in (prepare, _solve, certify_motion))


class StepParts:
    """Times the parts of one controller's steps."""

    def __init__(self, controller: Controller):
        self._controller, self._step = controller, controller.step
        self._taken: defaultdict[str, list[float]] = defaultdict(list)
        self._least: defaultdict[str, list[float]] = defaultdict(list)

    def time(self, state: StepState, task: StepRequest) -> None:
        """One pass over the parts of the step from a state that this controller has measured; nothing is kept of it."""
        scale = task.scale
        if scale is None or not scale > 0.0 or task.constraints:
            return
        context = self._controller.context
        arrays, pair = context.surroundings.arrays, context._pairs
        n, before = len(state.q), state.numbers
        wanted, given = qp.join_objectives(task.objectives, n + 1), context.no_rows
        workspace, after = np.zeros(program_size(n + 1, MAX_ROWS)), before.copy()
        answer = np.zeros(answer_size(n, n + 1, MAX_ROWS))
        inputs = (before, *wanted, given.matrix, given.bound, scale)
        hessian, gradient, upper, lower, matrix = program_views(workspace, n + 1, len(state.pairs))
        step, x, multiplier = answer_views(answer, n, n + 1, len(state.pairs))
        solver = (hessian, gradient, matrix, upper, lower)
        whole = (table_of((*arrays, *pair, workspace)), *inputs, np.zeros(n), answer, after)
        compiled = _seconds(fused_step, whole)
        self._taken["handing_over"].append(_seconds(_nothing, whole))
        self._taken["python"].append(_seconds(self._step, (state, task)) - compiled)
        self._part("rows", _rows, (*arrays[:2], *inputs, *solver))
        self._part("qp", _qp, (*solver, x, multiplier))
        step[:] = x[:n] * scale
        self._part("kinematics", _kinematics, (*arrays[:2], after))
        self._part("proximity", _proximity, (*arrays[:2], arrays[2:], after, *pair))
        self._part("certify", _certify, (*arrays, before, step, after, *pair))

    def told(self, median_us: float) -> tuple[dict[str, float], dict[str, float]]:
        """Median µs of each part, together those of a driven step, and of its floor.

        'handing_over' is what it takes to call compiled code, 'python' what is around that.
        """
        taken, least = (
            {name: 1e6 * float(np.median(values)) for name, values in every.items()}
            for every in (self._taken, self._least)
        )
        for every in (taken, least):
            every["certificate"] = max(every["certify"] - every["kinematics"] - every["proximity"], 0.0)
        split = {name: max(taken[name], 0.0) for name in (*PARTS, "handing_over", "python")}
        split["from_caches"] = median_us - sum(split.values())
        return split, {name: least.get(name, 0.0) for name in split}

    def _part(self, name: str, kernel: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        """As called, without the handing over, and many times in compiled code."""
        taken = _seconds(kernel, (1, *arguments)) - _seconds(kernel, (0, *arguments))
        self._taken[name].append(max(taken, 0.0))
        self._least[name].append(_seconds(kernel, (REPEATS, *arguments)) / REPEATS)


def _seconds(call: Callable[..., Any], arguments: tuple[Any, ...]) -> float:
    call(*arguments)
    taken = []
    for _ in range(CALLS):
        begin = time.perf_counter()
        call(*arguments)
        taken.append(time.perf_counter() - begin)
    return float(np.median(taken))
