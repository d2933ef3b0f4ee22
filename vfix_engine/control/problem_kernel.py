"""Rows to one scaled QP in the solver's layout, and the check of its answer, compiled (Li 2007, eq. 3, 20, 21).

Unknowns: y = (Δq / L, λ, slacks / L) with L the length of the wanted step, so that tolerances mean the same at every
speed; the objective is divided by L².
Limits come as the solver wants them: those of the unknowns first, then those of the rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..fixtures.boundary import approach, room_to_step
from ..fixtures.joint_limits import step_box
from ..fixtures.moment_kernel import BODY, moment_pairs, moment_parts
from ..geometry.compiled import compiled, inlined
from .world import Counts, World, unpack_world

Array = NDArray[np.float64]

UNBOUNDED = 1e30
REGULARISATION = 1e-9  # keeps H positive definite where an objective says nothing, e.g. about λ


@inlined
def add_objective(matrix: Array, target: Array, weight: Array, scale: float, hessian: Array, gradient: Array) -> None:
    """Add ½ w (A x − b)² of every row of ``matrix`` (m, n + 1) to H and f; ``weight``: (m,)."""
    size = matrix.shape[1]
    row = np.empty(size)
    for i in range(len(target)):
        for a in range(size):
            row[a] = matrix[i, a]
        row[size - 1] /= scale
        for a in range(size):
            pull = weight[i] * row[a]
            if pull != 0.0:
                gradient[a] -= pull * target[i] / scale
                for b in range(size):
                    hessian[a, b] += pull * row[b]


@compiled
def fill(
    matrix: Array, target: Array, weight: Array, little: Array, given: Array, bound: Array,
    pairs: Array, keep: Array, change: float, position: Array, jacobian: Array, scale: float,
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array,
) -> None:  # fmt: skip
    """H, f, G and the limits of all rows of one step, the given constraints first, then one row per pair.

    Unknowns beyond n + 1 are slacks: their columns and limits are left at 0 for the caller to write.

    Args:
        matrix, target, weight: objective rows (m, n + 1), (m,), (m,).
        little: (n + 1, n + 1) matrix AᵀA of objective rows without target that every step has.
        given, bound: constraint rows (k, n + 1), (k,).
        pairs: (p, 13), see ``moment_kernel``; keep: (B,) mm, what is kept from each body; change: see ``room_to_step``.
        position, jacobian: of the tip, (3,), (6, n); scale: L in mm.
        hessian, gradient, rows, upper, lower: out, (c, c), (c,), (k + p, c), (c + k + p,) twice.
    """
    size = len(little)
    hessian[:] = 0.0
    gradient[:] = 0.0
    rows[:] = 0.0
    upper[:] = 0.0
    lower[:] = -UNBOUNDED
    lower[: len(gradient)] = 0.0
    for a in range(size):
        for b in range(size):
            hessian[a, b] = little[a, b]
    add_objective(matrix, target, weight, scale, hessian, gradient)
    for a in range(len(gradient)):
        hessian[a, a] += REGULARISATION
    first = len(gradient)
    for i in range(len(bound)):
        for a in range(size):
            rows[i, a] = given[i, a]
        rows[i, size - 1] /= scale
        upper[first + i] = bound[i] / scale
    # One row per pair: it comes nearer by no more than it may (Li 2007, eq. 16-17, and approach_room).
    done = len(bound)
    for i in range(len(pairs)):
        approach(pairs[i, 1:4], pairs[i, 4:7], position, jacobian, rows[done + i])
        upper[first + done + i] = room_to_step(pairs[i, 0] - keep[int(pairs[i, BODY])], change) / scale


@compiled
def set_box(low: Array, high: Array, scale: float, upper: Array, lower: Array) -> None:
    """Limits of Δq (n,), and 0 … 1 for λ."""
    n = len(low)
    for j in range(n):
        lower[j], upper[j] = low[j] / scale, high[j] / scale
    lower[n], upper[n] = 0.0, 1.0


@compiled
def assemble(
    world: World, moment: Array, matrix: Array, target: Array, weight: Array, little: Array, given: Array, bound: Array,
    scale: float, hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array, box: Array,
) -> tuple[float, int]:  # fmt: skip
    """The QP of one step from a measured moment: ``fill`` with the box of the joints' limits.

    Args:
        scale: length of the wanted step in mm; the others as in ``fill``.
        box: out, (2, n) least and largest Δq that every limit of the joints allows.

    Returns:
        The scale L that was taken, and how many joints cannot keep their acceleration (see ``step_box``).
        What the joints do already counts for L as well, so that a robot that has to brake under a light hand is no
        badly scaled problem.
    """
    n, count, bodies = len(world.lower), len(world.radius), len(world.margin)
    q, velocity, position, _, jacobian, _, _, _ = moment_parts(moment, n, count, bodies)
    for j in range(n):
        scale = max(scale, abs(velocity[j]) * world.dt)
    pairs = moment_pairs(moment)
    fill(
        matrix, target, weight, little, given, bound, pairs, world.keep, world.change, position, jacobian, scale,
        hessian, gradient, rows, upper, lower,
    )  # fmt: skip
    low, high = box[0], box[1]
    broken = step_box(q, velocity, world.lower, world.upper, world.speed, world.acceleration, world.dt, low, high)
    set_box(low, high, scale, upper, lower)
    return scale, broken


@compiled
def prepare(
    numbers: Array, counts: Counts, moment: Array, matrix: Array, target: Array, weight: Array, little: Array,
    given: Array, bound: Array, scale: float,
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array, box: Array,
) -> tuple[float, int]:  # fmt: skip
    """``assemble`` with a ``PackedWorld``."""
    return assemble(
        unpack_world(numbers, counts), moment, matrix, target, weight, little, given, bound, scale,
        hessian, gradient, rows, upper, lower, box,
    )  # fmt: skip


@compiled
def settle(
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array, x: Array, multiplier: Array,
    primal: float, dual: float,
) -> bool:  # fmt: skip
    """Whether x fulfils the Karush-Kuhn-Tucker conditions within tolerance; if so it is put exactly into its limits.

    Nothing is violated, multipliers balance the gradient, have the right sign and belong to limits that are reached.

    Args:
        x: (c,) in and out; only its own limits are made exact, those of the rows stay within tolerance.
        upper, lower: (c + m,) of the unknowns, then of the rows; multiplier: the same, positive at an upper limit.
        primal: of a limit; dual: of the gradient, relative to its largest term.
    """
    size = len(x)
    balance, largest, idle = np.empty(size), 0.0, 0.0
    for a in range(size):
        curved = 0.0
        for b in range(size):
            curved += hessian[a, b] * x[b]
        balance[a] = curved + gradient[a] + multiplier[a]
        largest = max(largest, max(abs(curved), max(abs(gradient[a]), abs(multiplier[a]))))
        if not (x[a] <= upper[a] + primal and x[a] >= lower[a] - primal):
            return False
        if multiplier[a] != 0.0:
            left = upper[a] - x[a] if multiplier[a] > 0.0 else x[a] - lower[a]
            idle = max(idle, min(abs(multiplier[a]), left))
    pulls = np.zeros(size)
    wrong = 0.0
    for i in range(len(rows)):
        value = 0.0
        for a in range(size):
            value += rows[i, a] * x[a]
        if not value <= upper[size + i] + primal:
            return False
        weight = multiplier[size + i]
        wrong = min(wrong, weight)
        if weight != 0.0:
            idle = max(idle, min(weight, upper[size + i] - value))
            for a in range(size):
                pulls[a] += weight * rows[i, a]
    worst = 0.0
    for a in range(size):
        largest = max(largest, abs(pulls[a]))
        if not abs(balance[a] + pulls[a]) < np.inf:
            return False
        worst = max(worst, abs(balance[a] + pulls[a]))
    allowed = dual * (1.0 + largest)
    if not (worst <= allowed and wrong >= -allowed and idle <= allowed):
        return False
    for a in range(size):
        x[a] = min(max(x[a], lower[a]), upper[a])
    return True
