"""Assembly of the scaled QP of a step in the solver's layout, and the check of its solution (Li 2007, eq. 3, 20, 21).

Unknowns: y = (Δq / L, λ, slacks / L) with L the length of the wanted step, so that tolerances are independent of the
speed; the objective is divided by L².
Bounds are in the solver's order: those of the unknowns first, then those of the rows.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, IntArray
from ..certificate.constants import StepConstants, unpack_constants
from ..kernels.compiled import inlined, merged, no_refcount
from ..virtual_fixtures.boundary import approach
from ..virtual_fixtures.state_kernel import BODY, PAIR_COUNT, StateViews, state_views
from ..virtual_fixtures.stopping import approach_bound

UNBOUNDED = 1e30
PRIMAL_TOLERANCE = 1e-6  # of a row, in units of the step's length
DUAL_TOLERANCE = 1e-5  # of the stationarity residual, relative to the objective's gradient
REGULARISATION = 1e-9  # keeps H positive definite where no objective depends on an unknown, e.g. λ


@inlined
def add_objective(matrix: Array, target: Array, weight: Array, scale: float, hessian: Array, gradient: Array) -> None:
    """Add ½ w (A x − b)² of every row of ``matrix`` (m, n + 1) to H and f; ``weight``: (m,)."""
    n = matrix.shape[1] - 1
    for i in range(len(target)):
        last = matrix[i, n] / scale
        for a in range(n + 1):
            pull = weight[i] * (matrix[i, a] if a < n else last)
            if pull != 0.0:
                gradient[a] -= pull * target[i] / scale
                for b in range(n):
                    hessian[a, b] += pull * matrix[i, b]
                hessian[a, n] += pull * last


@no_refcount
def fill(
    matrix: Array, target: Array, weight: Array, regularisation: Array, given: Array, bound: Array,
    pairs: Array, count: int, buffered_margin: Array, change: float, position: Array, jacobian: Array, scale: float,
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array,
) -> None:  # fmt: skip
    """Fill H, f, G and the bounds of one step: the given constraints first, then one row per pair.

    Unknowns beyond n + 1 are slack variables: their columns and bounds stay 0 for the caller to fill.

    Args:
        matrix, target, weight: objective rows (m, n + 1), (m,), (m,).
        regularisation: (n + 1, n + 1) matrix WᵀW of the objective rows without target that every step has.
        given, bound: constraint rows (k, n + 1), (k,).
        pairs: (p or more, 13), see ``state_kernel``; count: p; buffered_margin: (B,) mm, per obstacle;
            change: see ``approach_bound``.
        position, jacobian: of the tip, (3,), (6, n); scale: L in mm.
        hessian, gradient, rows, upper, lower: out, (c, c), (c,), (k + p, c), and twice (c + k + p,).
    """
    size = len(regularisation)
    hessian[:] = 0.0
    gradient[:] = 0.0
    rows[:] = 0.0
    upper[:] = 0.0
    lower[:] = -UNBOUNDED
    lower[: len(gradient)] = 0.0
    for a in range(size):
        for b in range(size):
            hessian[a, b] = regularisation[a, b]
    add_objective(matrix, target, weight, scale, hessian, gradient)
    for a in range(len(gradient)):
        hessian[a, a] += REGULARISATION
    first = len(gradient)
    for i in range(len(bound)):
        for a in range(size):
            rows[i, a] = given[i, a]
        rows[i, size - 1] /= scale
        upper[first + i] = bound[i] / scale
    # One row per pair bounds its approach (Li 2007, eq. 16-17, and approach_bound).
    done = len(bound)
    for i in range(count):
        approach(pairs[i, 1:4], pairs[i, 4:7], position, jacobian, rows[done + i])
        upper[first + done + i] = approach_bound(pairs[i, 0] - buffered_margin[int(pairs[i, BODY])], change) / scale


@no_refcount
def set_box(low: Array, high: Array, scale: float, upper: Array, lower: Array) -> None:
    """Set the bounds of Δq (n,), and 0 … 1 for λ."""
    n = len(low)
    for j in range(n):
        lower[j], upper[j] = low[j] / scale, high[j] / scale
    lower[n], upper[n] = 0.0, 1.0


@merged
def assemble(
    constants: StepConstants, state: StateViews, matrix: Array, target: Array, weight: Array, given: Array,
    bound: Array, scale: float, hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array,
) -> float:  # fmt: skip
    """Assemble the QP of one step from a measured state: ``fill``, and the bounds of the joints.

    Args:
        scale: length of the wanted step in mm; the others as in ``fill``.

    Returns:
        The scale L that is used. It includes the present motion of the joints, so that the problem of a robot that
        brakes under a light hand is well scaled.
    """
    for j in range(len(constants.lower)):
        scale = max(scale, abs(state.velocity[j]) * constants.dt)
    fill(
        matrix, target, weight, constants.regularisation, given, bound, state.pairs, int(state.counts[PAIR_COUNT]),
        constants.buffered_margin, constants.change, state.position, state.jacobian, scale, hessian, gradient,
        rows, upper, lower,
    )  # fmt: skip
    set_box(state.box[0], state.box[1], scale, upper, lower)
    return scale


@no_refcount
def prepare(
    numbers: Array, counts: IntArray, before: Array, matrix: Array, target: Array, weight: Array,
    given: Array, bound: Array, scale: float,
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array,
) -> float:  # fmt: skip
    """``assemble`` with packed constants and a packed state."""
    constants = unpack_constants(numbers, counts)
    state = state_views(before, len(constants.lower), len(constants.radius), len(constants.margin))
    return assemble(
        constants, state, matrix, target, weight, given, bound, scale, hessian, gradient, rows, upper, lower
    )  # fmt: skip


@no_refcount
def check_kkt(
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array, x: Array, multiplier: Array,
    primal: float, dual: float,
) -> bool:  # fmt: skip
    """Check the Karush-Kuhn-Tucker conditions of x within tolerance; if they hold, clip x to its bounds.

    Primal feasibility, stationarity, the signs of the multipliers and complementarity are checked.

    Args:
        x: (c,) in and out; only its own bounds are made exact, rows hold within tolerance.
        upper, lower: (c + m,) of the unknowns, then of the rows; multiplier: the same, positive at an upper bound.
        primal: tolerance of a bound; dual: of the gradient, relative to its largest term.
    """
    size = len(x)
    largest, idle, wrong, worst = 0.0, 0.0, 0.0, 0.0
    for a in range(size):
        if not (x[a] <= upper[a] + primal and x[a] >= lower[a] - primal):
            return False
        if multiplier[a] != 0.0:
            left = upper[a] - x[a] if multiplier[a] > 0.0 else x[a] - lower[a]
            idle = max(idle, min(abs(multiplier[a]), left))
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
        curved, pull = 0.0, 0.0
        for b in range(size):
            curved += hessian[a, b] * x[b]
        for i in range(len(rows)):
            if multiplier[size + i] != 0.0:
                pull += multiplier[size + i] * rows[i, a]
        largest = max(largest, max(max(abs(curved), abs(gradient[a])), max(abs(multiplier[a]), abs(pull))))
        balance = curved + gradient[a] + multiplier[a] + pull
        if not abs(balance) < np.inf:
            return False
        worst = max(worst, abs(balance))
    allowed = dual * (1.0 + largest)
    if not (worst <= allowed and wrong >= -allowed and idle <= allowed):
        return False
    for a in range(size):
        x[a] = min(max(x[a], lower[a]), upper[a])
    return True
