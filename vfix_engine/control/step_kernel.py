"""A whole step in one compiled call: program, solution, check, predicted pose and certificate (Li 2007, section IV).

It handles the usual case with the same parts that ``step`` calls one by one in all other cases.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..arrays import Array, Float32Array, Int32Array, IntArray
from ..certificate.certify_kernel import certify_motion
from ..certificate.constants import unpack_constants
from ..kernels.array_table import float32_at, float64_at, int32_at, int64_at
from ..kernels.compiled import compiled, shared
from ..kernels.packed import packing
from ..virtual_fixtures.state_kernel import PAIR_COUNT, state_views
from .dual_kernel import solve_dual
from .problem_kernel import DUAL_TOLERANCE, PRIMAL_TOLERANCE, assemble, check_kkt

UNSOLVED = 4  # outcome of a step in addition to the verdicts of ``certify_kernel``


class ProgramViews(NamedTuple):
    """Layout of a packed program; c unknowns, m rows; see ``program.Program``."""

    hessian: Annotated[Array, "c", "c"]
    gradient: Annotated[Array, "c"]
    upper: Annotated[Array, "c + m"]
    lower: Annotated[Array, "c + m"]
    rows: Annotated[Array, "m", "c"]


class AnswerViews(NamedTuple):
    """Layout of the packed solution of a program; n joints.

    step: (n,) Δq in mm and rad; x: (c,) the scaled unknowns; multiplier: (c + m,).
    """

    step: Annotated[Array, "n"]
    x: Annotated[Array, "c"]
    multiplier: Annotated[Array, "c + m"]


PROGRAM, ANSWER = packing(ProgramViews, "c", "m"), packing(AnswerViews, "n", "c", "m")
program_views, program_size = PROGRAM.views, PROGRAM.size
answer_views, answer_size = ANSWER.views, ANSWER.size


@shared
def unpack_table(
    t: IntArray,
) -> tuple[Array, IntArray, Float32Array, Array, Int32Array, Int32Array, Array, Array, Int32Array, Int32Array, Array]:
    """Arrays of a table (``array_table.table_of``), the constant arguments of a context's steps; compiled code only."""
    return (
        float64_at(t[0], (t[1],)), int64_at(t[2], (t[3],)),
        float32_at(t[4], (t[5],)), float64_at(t[6], (t[7],)), int32_at(t[8], (t[9],)),
        int32_at(t[10], (t[11], t[12])), float64_at(t[13], (t[14],)),
        float64_at(t[15], (t[16], t[17])), int32_at(t[18], (t[19], t[20])), int32_at(t[21], (t[22],)),
        float64_at(t[23], (t[24],)),
    )  # fmt: skip


@compiled
def fused_step(
    table: IntArray, before: Array, matrix: Array, target: Array, weight: Array, given: Array, bound: Array,
    scale: float, motion_gain: Array, answer: Array, after: Array,
) -> tuple[int, int, float, float, int, float]:  # fmt: skip
    """Make one step of a program without slack variables.

    Args:
        table: of packed constants, packed candidates, the pairs' workspace (see ``certify_motion``) and the program's
            (out, see ``ProgramViews``), in the order of ``unpack_table``; before: a packed state.
        matrix … bound: rows of the program, see ``problem_kernel.fill``; scale: length of the wanted step in mm.
        motion_gain: (n,) fraction of the wanted motion per unit of each joint's motion.
        answer: out, see ``AnswerViews``; after: out, see ``certify_motion``.

    Returns:
        The verdict of ``certify_motion``, its rows and its displacement, or UNSOLVED; the achieved fraction of the
        wanted motion; the number of rows of the program; its scale.
    """
    numbers, counts, boxes, corners, label, first, poses, rows, labels, body, workspace = unpack_table(table)
    constants = unpack_constants(numbers, counts)
    n = len(constants.lower)
    state = state_views(before, n, len(constants.radius), len(constants.margin))
    m = len(bound) + int(state.counts[PAIR_COUNT])
    p, a = program_views(workspace, n + 1, m), answer_views(answer, n, n + 1, m)
    scale = assemble(
        constants, state, matrix, target, weight, given, bound, scale, p.hessian, p.gradient, p.rows, p.upper, p.lower
    )  # fmt: skip
    if not solve_dual(p.hessian, p.gradient, p.rows, p.upper, p.lower, a.x, a.multiplier):
        return UNSOLVED, 0, 0.0, 0.0, m, scale
    if not check_kkt(
        p.hessian, p.gradient, p.rows, p.upper, p.lower, a.x, a.multiplier, PRIMAL_TOLERANCE, DUAL_TOLERANCE
    ):
        return UNSOLVED, 0, 0.0, 0.0, m, scale
    share = 0.0
    for j in range(n):
        a.step[j] = a.x[j] * scale
        share += motion_gain[j] * a.step[j]
    verdict, needed, displacement = certify_motion(
        numbers, counts, boxes, corners, label, first, poses, before, a.step, after, rows, labels, body
    )
    return verdict, needed, displacement, share, m, scale
