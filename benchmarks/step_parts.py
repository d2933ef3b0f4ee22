"""Times of the parts of the compiled step, and their lower bounds.

A part is called a few times from Python at poses of the drive, and the cost of passing its arguments (the same call
that repeats the part zero times) is subtracted.
Its floor is the same kernel repeated inside compiled code: everything in the fastest cache, no arguments passed.
The time of a step in the drive beyond the sum of its parts is reported as 'from_caches', since code and data are then
no longer in the nearest caches.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from vfix_engine.certificate.certify_kernel import certify_motion
from vfix_engine.certificate.inputs import unpack_inputs
from vfix_engine.certificate.measure_kernel import measure, place
from vfix_engine.control import Controller, StepRequest, StepState, qp
from vfix_engine.control.dual_kernel import solve_within, solver_size, solver_views
from vfix_engine.control.problem_kernel import DUAL_TOLERANCE, PRIMAL_TOLERANCE, check_kkt, prepare
from vfix_engine.control.step_kernel import answer_of, fused_step, program_size, program_views
from vfix_engine.virtual_fixtures.state_kernel import state_views

PARTS = ("kinematics", "proximity", "rows", "qp", "certificate")
REPEATS = 20  # of a kernel for its floor
CALLS = 7  # of a part, of which the median is used; the first call is not timed


_LIKE_KERNELS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}


def _bare(function: Any) -> Any:
    return numba.njit(**_LIKE_KERNELS)(function)


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
def _kinematics(times, table, after):  # type: ignore[no-untyped-def]
    constants = unpack_inputs(table).constants
    s = state_views(after, len(constants.lower), len(constants.radius), len(constants.margin))
    for _ in range(times):
        place(constants, s.q, s.position, s.rotation, s.jacobian, s.start, s.end)


@_bare
def _proximity(times, table, after):  # type: ignore[no-untyped-def]
    inputs = unpack_inputs(table)
    constants = inputs.constants
    s = state_views(after, len(constants.lower), len(constants.radius), len(constants.margin))
    for _ in range(times):
        measure(inputs, s.start, s.end, inputs.scratch.within, s.distance)  # as far as in the step before


@_bare
def _solve(hessian, gradient, rows, upper, lower, x, multiplier, workspace):  # type: ignore[no-untyped-def]
    solve_within(hessian, gradient, rows, upper, lower, x, multiplier, workspace)
    check_kkt(hessian, gradient, rows, upper, lower, x, multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE)


_rows, _qp, _certify = (_repeated(kernel) for kernel in (prepare, _solve, certify_motion))


class StepParts:
    """Times the parts of one controller's steps."""

    def __init__(self, controller: Controller):
        self._controller, self._step = controller, controller.step
        self._taken: defaultdict[str, list[float]] = defaultdict(list)
        self._least: defaultdict[str, list[float]] = defaultdict(list)

    def time(self, state: StepState, task: StepRequest) -> None:
        """Time the parts of the step once, from a state that this controller has measured, and discard the results."""
        scale = task.scale
        if scale is None or not scale > 0.0 or task.constraints:
            return
        context = self._controller.context
        n, count, before, after = len(state.q), len(state.pairs), state.numbers, context.step_numbers(0)
        wanted, given = qp.join_objectives(task.objectives, n + 1), context.no_rows
        inputs = (before, *wanted, given.matrix, given.bound, scale)
        program, answer = np.empty(program_size(n + 1, count)), answer_of(after, context.layout.size, n, count)
        hessian, gradient, upper, lower, matrix = program_views(program, n + 1, count)
        solver = (hessian, gradient, matrix, upper, lower)
        workspace = solver_views(np.empty(solver_size(n + 1, count)), n + 1, count)
        whole = (context.table, *inputs, np.zeros(n), after)
        compiled = _seconds(fused_step, whole)
        self._taken["handing_over"].append(_seconds(_nothing, whole))
        self._taken["python"].append(_seconds(self._step, (state, task)) - compiled)
        self._part("rows", _rows, (*context.packed, *inputs, *solver))
        self._part("qp", _qp, (*solver, answer.x, answer.multiplier, workspace))
        self._part("certify", _certify, (context.table, before, answer.step, after))
        self._part("kinematics", _kinematics, (context.table, after))
        self._part("proximity", _proximity, (context.table, after))

    def told(self, median_us: float) -> tuple[dict[str, float], dict[str, float]]:
        """Return the median µs of each part, which add up to those of a driven step, and of its floor.

        'handing_over' is the time to call compiled code, 'python' the time around that.
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
        """Time a part as called, without passing its arguments, and repeated in compiled code."""
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
