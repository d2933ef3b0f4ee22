"""The parts of the compiled step one by one: what each takes, and what it takes at the very least.

A part is called from Python at poses of the drive, a few times, and what handing over its arguments costs is taken off
again (the same call that repeats the part zero times).
Its floor is the same kernel repeated inside compiled code: everything in the fastest cache, nothing handed over.
What a step takes in the drive beyond the sum of its parts, code and data being no longer in the nearest caches when its
turn comes, is told as 'from_caches'.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from vfix_engine.arrays import Array
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

_bare = numba.njit(error_model="numpy")


@_bare
def _nothing(*arguments: Any) -> int:
    return 0


@_bare
def _kinematics(times: int, numbers: Any, counts: Any, after: Array) -> None:
    constants = unpack_constants(numbers, counts)
    s = state_views(after, len(constants.lower), len(constants.radius), len(constants.margin))
    for _ in range(times):
        place(constants, s.q, s.position, s.rotation, s.jacobian, s.start, s.end)


@_bare
def _proximity(
    times: int, numbers: Any, counts: Any, boxes: Any, corners: Any, label: Any, first: Any, poses: Any,
    after: Array, rows: Array, labels: Any, body: Any,
) -> None:  # fmt: skip
    constants = unpack_constants(numbers, counts)
    candidates = unpack_candidates(len(constants.radius), boxes, corners, label, first, poses)
    s = state_views(after, len(constants.lower), len(constants.radius), len(constants.margin))
    for _ in range(times):
        measure(constants, candidates, s.start, s.end, constants.threshold, s.distance, rows, labels, body)


@_bare
def _rows(
    times: int, numbers: Any, counts: Any, before: Array, matrix: Array, target: Array, weight: Array,
    given: Array, bound: Array, scale: float,
    hessian: Array, gradient: Array, program: Array, upper: Array, lower: Array,
) -> None:  # fmt: skip
    for _ in range(times):
        prepare(
            numbers, counts, before, matrix, target, weight, given, bound, scale,
            hessian, gradient, program, upper, lower,
        )  # fmt: skip


@_bare
def _qp(
    times: int, hessian: Array, gradient: Array, program: Array, upper: Array, lower: Array, x: Array, multiplier: Array
) -> None:
    for _ in range(times):
        solve_dual(hessian, gradient, program, upper, lower, x, multiplier)
        check_kkt(hessian, gradient, program, upper, lower, x, multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE)


@_bare
def _certify(
    times: int, numbers: Any, counts: Any, boxes: Any, corners: Any, label: Any, first: Any, poses: Any,
    before: Array, step: Array, after: Array, rows: Array, labels: Any, body: Any,
) -> None:  # fmt: skip
    for _ in range(times):
        certify_motion(
            numbers, counts, boxes, corners, label, first, poses,
            before, step, after, rows, labels, body,
        )  # fmt: skip


class StepParts:
    """Times the parts of one controller's steps."""

    def __init__(self, controller: Controller):
        self._controller, self._step = controller, controller.step
        self._taken: dict[str, list[float]] = {}
        self._least: dict[str, list[float]] = {}

    def time(self, state: StepState, task: StepRequest) -> None:
        """One pass over the parts of the step from a state that this controller has measured; nothing is kept of it."""
        scale = task.scale
        if scale is None or not scale > 0.0 or task.constraints:
            return
        context = self._controller.context
        arrays, (rows, labels, body) = context.surroundings.arrays, context._pairs
        n, before = len(state.q), state.numbers
        wanted, given = qp.join_objectives(task.objectives, n + 1), context.no_rows
        workspace, after = np.zeros(program_size(n + 1, MAX_ROWS)), before.copy()
        answer = np.zeros(answer_size(n, n + 1, MAX_ROWS))
        inputs = (before, *wanted, given.matrix, given.bound, scale)
        hessian, gradient, upper, lower, matrix = program_views(workspace, n + 1, len(state.pairs))
        step, x, multiplier = answer_views(answer, n, n + 1, len(state.pairs))
        solver = (hessian, gradient, matrix, upper, lower)
        whole = (table_of((*arrays, rows, labels, body, workspace)), *inputs, np.zeros(n), answer, after)
        called = _seconds(fused_step, whole)
        self._note("handing over", _seconds(_nothing, whole), 0.0)
        self._note("whole step", _seconds(self._step, (state, task)), 0.0)
        self._note("compiled", called, 0.0)
        self._part("rows", _rows, (*arrays[:2], *inputs, *solver))
        self._part("qp", _qp, (*solver, x, multiplier))
        step[:] = x[:n] * scale
        self._part("kinematics", _kinematics, (*arrays[:2], after))
        self._part("proximity", _proximity, (*arrays, after, rows, labels, body))
        self._part("certify", _certify, (*arrays, before, step, after, rows, labels, body))

    def told(self, median_us: float) -> tuple[dict[str, float], dict[str, float]]:
        """Median µs of each part, together those of a driven step, and of its floor.

        'handing_over' is what it takes to call compiled code, 'python' what is around that.
        """
        taken = {name: 1e6 * float(np.median(values)) for name, values in self._taken.items()}
        least = {name: 1e6 * float(np.median(values)) for name, values in self._least.items()}
        for every in (taken, least):
            every["certificate"] = max(every["certify"] - every["kinematics"] - every["proximity"], 0.0)
        split = {name: taken[name] for name in PARTS}
        split["handing_over"] = taken["handing over"]
        split["python"] = max(taken["whole step"] - taken["compiled"], 0.0)
        split["from_caches"] = median_us - sum(split.values())
        return split, {name: least[name] for name in PARTS} | dict.fromkeys(list(split)[len(PARTS) :], 0.0)

    def _part(self, name: str, kernel: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        """As called, without the handing over, and many times in compiled code."""
        taken = _seconds(kernel, (1, *arguments)) - _seconds(kernel, (0, *arguments))
        self._note(name, max(taken, 0.0), _seconds(kernel, (REPEATS, *arguments)) / REPEATS)

    def _note(self, name: str, taken: float, least: float) -> None:
        self._taken.setdefault(name, []).append(taken)
        self._least.setdefault(name, []).append(least)


def _seconds(call: Callable[..., Any], arguments: tuple[Any, ...]) -> float:
    call(*arguments)
    taken = []
    for _ in range(CALLS):
        begin = time.perf_counter()
        call(*arguments)
        taken.append(time.perf_counter() - begin)
    return float(np.median(taken))
