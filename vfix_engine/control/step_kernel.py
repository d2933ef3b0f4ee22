"""A whole step in one compiled call: program, solution, check, predicted pose and certificate (Li 2007, section IV).

It handles the usual case with the same parts that ``step`` calls one by one in all other cases.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..arrays import Array, IntArray
from ..certificate.certify_kernel import certify
from ..certificate.inputs import unpack_inputs
from ..kernels.compiled import no_refcount, shared
from ..kernels.packed import packing
from ..kernels.views import view
from ..virtual_fixtures.state_kernel import BROKEN_COUNT, PAIR_COUNT, state_size, state_views
from .dual_kernel import SolverViews, solve_within, solver_size, solver_views
from .problem_kernel import DUAL_TOLERANCE, PRIMAL_TOLERANCE, assemble, check_kkt

UNSOLVED = 4  # outcome of a step in addition to the verdicts of ``certify_kernel``
NEEDED, DISPLACEMENT, SCALE = range(3)  # places in ``AnswerViews.told``


class ProgramViews(NamedTuple):
    """Layout of a packed program; c unknowns, m rows; see ``program.Program``."""

    hessian: Annotated[Array, "c", "c"]
    gradient: Annotated[Array, "c"]
    upper: Annotated[Array, "c + m"]
    lower: Annotated[Array, "c + m"]
    rows: Annotated[Array, "m", "c"]


class AnswerViews(NamedTuple):
    """Layout of the packed answer of a step; n joints, c unknowns, m rows.

    told: number of rows and displacement that ``certify`` returned; scale of the program.
    step: (n,) Δq in mm and rad; x: (c,) the scaled unknowns; multiplier: (c + m,).
    """

    told: Annotated[Array, 3]
    step: Annotated[Array, "n"]
    x: Annotated[Array, "c"]
    multiplier: Annotated[Array, "c + m"]


PROGRAM, ANSWER = packing(ProgramViews, "c", "m"), packing(AnswerViews, "n", "c", "m")
program_views, program_size = PROGRAM.views, PROGRAM.size
_answer_views, answer_size = ANSWER.views, ANSWER.size


@shared
def workspace_size(c: int, m: int) -> int:
    """Length of the workspace of a program: the program itself, then that of its solver."""
    size: int = program_size(c, m) + solver_size(c, m)
    return size


@shared
def solver_behind(workspace: Array, c: int, m: int) -> SolverViews:
    """Views of the solver's part of a program's workspace."""
    views: SolverViews = solver_views(view(workspace, program_size(c, m), (solver_size(c, m),)), c, m)
    return views


@shared
def answer_of(after: Array, first: int, n: int, m: int) -> AnswerViews:
    """Views of the answer behind the ``first`` numbers of a step's state; of a program without slack variables."""
    c = n + 1
    views: AnswerViews = _answer_views(view(after, first, (answer_size(n, c, m),)), n, c, m)
    return views


@no_refcount
def fused_step(
    table: IntArray, before: Array, matrix: Array, target: Array, weight: Array, given: Array, bound: Array,
    scale: float, motion_gain: Array, after: Array,
) -> tuple[int, float, int, bool]:  # fmt: skip
    """Make one step of a program without slack variables.

    Args:
        table: see ``inputs.unpack_inputs``; its workspace gets the program; before: a packed state.
        matrix … bound: rows of the program, see ``problem_kernel.fill``; scale: length of the wanted step in mm.
        motion_gain: (n,) fraction of the wanted motion per unit of each joint's motion.
        after: out, the packed state at the end of the motion and, behind it, the answer (``answer_of``).

    Returns:
        The verdict of ``certify``, or UNSOLVED; the achieved fraction of the wanted motion; the number of rows of the
        program; whether a joint must exceed its acceleration limit.
    """
    inputs = unpack_inputs(table)
    constants = inputs.constants
    n, s, b = len(constants.lower), len(constants.radius), len(constants.margin)
    state = state_views(before, n, s, b)
    c, m, broken = n + 1, len(bound) + int(state.counts[PAIR_COUNT]), state.counts[BROKEN_COUNT] > 0.0
    p, a = program_views(inputs.program, c, m), answer_of(after, state_size(n, s, b), n, m)
    a.told[SCALE] = scale = assemble(
        constants, state, matrix, target, weight, given, bound, scale, p.hessian, p.gradient, p.rows, p.upper, p.lower
    )  # fmt: skip
    solver = solver_behind(inputs.program, c, m)
    if not solve_within(p.hessian, p.gradient, p.rows, p.upper, p.lower, a.x, a.multiplier, solver):
        return UNSOLVED, 0.0, m, broken
    if not check_kkt(
        p.hessian, p.gradient, p.rows, p.upper, p.lower, a.x, a.multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE
    ):
        return UNSOLVED, 0.0, m, broken
    share = 0.0
    for j in range(n):
        a.step[j] = a.x[j] * scale
        share += motion_gain[j] * a.step[j]
    verdict, a.told[NEEDED], a.told[DISPLACEMENT] = certify(inputs, before, a.step, after)
    return verdict, share, m, broken
