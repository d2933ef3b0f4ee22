"""A whole step in one compiled call: program, solution, check, predicted pose and certificate (Li 2007, section IV).

It is the usual course of things, made of the same parts that ``controller`` calls one by one where anything is unusual.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..fixtures.moment_kernel import pair_count
from ..geometry.compiled import compiled, shared
from ..geometry.views import view
from .dual_kernel import solve_dual
from .judge_kernel import judge
from .problem_kernel import assemble, settle
from .world import Counts, Single, unpack_world

Array = NDArray[np.float64]
Index = NDArray[np.int32]

UNSOLVED = 4  # what an attempt can end in besides the verdicts of ``judge_kernel``


def room_size(joints: int, rows: int) -> int:
    """Numbers that an attempt with n joints and m rows needs for its program."""
    unknowns = joints + 1
    return unknowns * (unknowns + 2) + 3 * (unknowns + rows) + unknowns * rows + 3 * joints


@shared
def room_parts(room: Array, n: int, m: int) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array, Array]:
    """Views of the room of an attempt with n joints, c = n + 1 unknowns and m rows.

    They are H (c, c), f (c,), G (m, c), upper (c + m,), lower (c + m,), x (c,), multipliers (c + m,), box (2, n) and
    the step (n,), with which the room begins.
    """
    c, hessian = n + 1, 3 * n
    gradient = hessian + c * c
    upper = gradient + c
    lower = upper + c + m
    x = lower + c + m
    multiplier = x + c
    return (
        view(room, hessian, (c, c)), view(room, gradient, (c,)), view(room, multiplier + c + m, (m, c)),
        view(room, upper, (c + m,)), view(room, lower, (c + m,)), view(room, x, (c,)),
        view(room, multiplier, (c + m,)), view(room, n, (2, n)), view(room, 0, (n,)),
    )  # fmt: skip


@compiled
def attempt(
    numbers: Array, counts: Counts,
    boxes: Single, corners: Array, label: Index, first: Index, poses: Array,
    rows: Array, labels: Index, body: Index,
    before: Array, matrix: Array, target: Array, weight: Array, little: Array, given: Array, bound: Array,
    scale: float, along: Array, primal: float, dual: float, room: Array, after: Array,
) -> tuple[int, int, float, float, int, int]:  # fmt: skip
    """One step of a program without slacks.

    Args:
        numbers … poses: packed world and cover; rows, labels, body: see ``judge``; before: a measured moment.
        matrix … bound: rows of the program, see ``problem_kernel.fill``; scale: length of the wanted step in mm.
        along: (n,) part of the wanted motion that each joint's motion makes.
        primal, dual: tolerances of the check, see ``settle``; room: for MAX_ROWS pairs, see ``room_parts``.
        after: out, see ``judge``.

    Returns:
        The verdict of ``judge``, its rows and its way, or UNSOLVED; the part of the wanted motion that is made;
        how many rows the program has; how many joints cannot keep their acceleration.
    """
    world = unpack_world(numbers, counts)
    m, n = len(bound) + pair_count(before), len(world.lower)
    hessian, gradient, program, upper, lower, x, multiplier, box, step = room_parts(room, n, m)
    scale, broken = assemble(
        world, before, matrix, target, weight, little, given, bound, scale,
        hessian, gradient, program, upper, lower, box,
    )  # fmt: skip
    solved = solve_dual(hessian, gradient, program, upper, lower, x, multiplier)
    if not (solved and settle(hessian, gradient, program, upper, lower, x, multiplier, primal, dual)):
        return UNSOLVED, 0, 0.0, 0.0, m, broken
    share = 0.0
    for j in range(n):
        step[j] = x[j] * scale
        share += along[j] * step[j]
    verdict, needed, way = judge(
        numbers, counts, boxes, corners, label, first, poses, before, step, after, rows, labels, body
    )
    return verdict, needed, way, share, m, broken
