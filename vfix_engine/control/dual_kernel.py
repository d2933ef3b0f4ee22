"""The dual active-set method of Goldfarb and Idnani (1983) for small dense QPs, compiled.

Minimise ½ xᵀH x + fᵀx subject to lower ≤ x ≤ upper and G x ≤ h, with H positive definite.
The method starts at the unconstrained minimum and adds one violated constraint after the other, dropping those whose
multiplier would become negative, so that every iterate is the minimum under the active set.
With H = L Lᵀ the kernel updates J = L⁻ᵀQ and the triangular factor R of the active normals N: Jᵀ N = (R; 0).
Its solution is verified by ``problem_kernel.check_kkt`` like that of any other solver.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled, inlined, no_refcount
from ..kernels.packed import packing

MOST_TURNS = 300  # iterations; the programs of a step need about a dozen
_VIOLATED = 1e-9  # tolerance of a constraint for rounding, in units of the step's length
_DEPENDENT = 1e-20  # squared fraction of a normal outside the span of the active ones that counts as rounding


class SolverViews(NamedTuple):
    """Workspace of the solver; c unknowns, m rows.

    factor: L; basis: J; triangle: R; d: −Jᵀ a of a normal a; r: change of the multipliers.
    members, weights: indices and multipliers of the active constraints; active: 1 for each of these, otherwise 0.
    """

    factor: Annotated[Array, "c", "c"]
    basis: Annotated[Array, "c", "c"]
    triangle: Annotated[Array, "c", "c"]
    d: Annotated[Array, "c"]
    r: Annotated[Array, "c"]
    members: Annotated[Array, "c"]
    weights: Annotated[Array, "c"]
    active: Annotated[Array, "2 * c + m"]


SOLVER = packing(SolverViews, "c", "m")
solver_views, solver_size = SOLVER.views, SOLVER.size


@inlined
def _inverse_factor(hessian: Array, factor: Array, inverse: Array) -> bool:
    """Compute L⁻ᵀ of H = L Lᵀ as an upper triangle; False if H is not positive definite."""
    size = len(hessian)
    for j in range(size):
        for i in range(j, size):
            total = hessian[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                factor[j, j] = np.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    for j in range(size):  # column j of L⁻¹ becomes row j of its transpose
        for i in range(size):
            total = 1.0 if i == j else 0.0
            for k in range(j, i):
                total -= factor[i, k] * inverse[j, k]
            inverse[j, i] = total / factor[i, i] if i >= j else 0.0
    return True


@inlined
def _excess(rows: Array, upper: Array, lower: Array, x: Array, limit: int) -> float:
    """Return the violation of a constraint by x; indices: upper bounds of the unknowns, their lower bounds, rows."""
    size = len(x)
    if limit < size:
        value = x[limit] - upper[limit]
    elif limit < 2 * size:
        value = lower[limit - size] - x[limit - size]
    else:
        value = -upper[limit - size]
        for a in range(size):
            value += rows[limit - 2 * size, a] * x[a]
    excess: float = value
    return excess


@inlined
def _most_violated(rows: Array, upper: Array, lower: Array, x: Array, active: Array) -> tuple[int, float]:
    """Return the inactive constraint with the largest violation, and the violation; −1 if there is none."""
    size = len(x)
    worst, most = -1, _VIOLATED
    for a in range(size):
        above, below = x[a] - upper[a], lower[a] - x[a]
        if not above <= most and active[a] == 0.0:
            worst, most = a, above
        if not below <= most and active[size + a] == 0.0:
            worst, most = size + a, below
    for i in range(len(rows)):
        excess = -upper[size + i]
        for a in range(size):
            excess += rows[i, a] * x[a]
        if not excess <= most and active[2 * size + i] == 0.0:
            worst, most = 2 * size + i, excess
    return worst, most


@inlined
def _against(rows: Array, basis: Array, limit: int, d: Array) -> None:
    """Compute d = −Jᵀ a with a the normal of a constraint."""
    size = len(basis)
    for k in range(size):
        if limit < size:
            d[k] = -basis[limit, k]
        elif limit < 2 * size:
            d[k] = basis[limit - size, k]
        else:
            d[k] = 0.0
            for a in range(size):
                d[k] -= basis[a, k] * rows[limit - 2 * size, a]


@no_refcount
def _turn(basis: Array, one: int, two: int, c: float, s: float) -> None:
    """Apply a Givens rotation to two columns of J."""
    for i in range(len(basis)):
        a, b = basis[i, one], basis[i, two]
        basis[i, one], basis[i, two] = c * a + s * b, c * b - s * a


@inlined
def _add(basis: Array, triangle: Array, d: Array, count: int) -> None:
    """Append d as column ``count`` of R, with rotations that zero its entries beyond that."""
    for k in range(len(d) - 1, count, -1):
        size = np.hypot(d[k - 1], d[k])
        if size > 0.0:
            c, s = d[k - 1] / size, d[k] / size
            d[k - 1], d[k] = size, 0.0
            _turn(basis, k - 1, k, c, s)
    for k in range(count + 1):
        triangle[k, count] = d[k]


@inlined
def _drop(basis: Array, triangle: Array, members: Array, weights: Array, count: int, place: int) -> None:
    """Remove column ``place`` from R and restore the triangle."""
    for j in range(place, count - 1):
        members[j], weights[j] = members[j + 1], weights[j + 1]
        for k in range(count):
            triangle[k, j] = triangle[k, j + 1]
    for j in range(place, count - 1):
        size = np.hypot(triangle[j, j], triangle[j + 1, j])
        if size > 0.0:
            c, s = triangle[j, j] / size, triangle[j + 1, j] / size
            for k in range(j, count - 1):
                a, b = triangle[j, k], triangle[j + 1, k]
                triangle[j, k], triangle[j + 1, k] = c * a + s * b, c * b - s * a
            _turn(basis, j, j + 1, c, s)


@compiled
def solve_dual(
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array, x: Array, multiplier: Array
) -> bool:
    """``solve_within`` with a workspace of its own."""
    c, m = len(gradient), len(rows)
    workspace = np.empty(solver_size(c, m))
    return solve_within(hessian, gradient, rows, upper, lower, x, multiplier, solver_views(workspace, c, m))


@no_refcount
def solve_within(
    hessian: Array, gradient: Array, rows: Array, upper: Array, lower: Array, x: Array, multiplier: Array,
    workspace: SolverViews,
) -> bool:  # fmt: skip
    """Write the minimiser x (c,) and the multipliers (c + m,), positive at an upper bound.

    Args:
        upper, lower: (c + m,) bounds of the unknowns, then of the rows; lower bounds of rows are ignored.

    Returns:
        False if H is not positive definite, the constraints are inconsistent or rounding errors prevent convergence.
    """
    size = len(gradient)
    factor, basis, triangle, d, r, members, weights, active = workspace
    if not _inverse_factor(hessian, factor, basis):
        return False
    for k in range(size):
        d[k] = 0.0
        for a in range(size):
            d[k] -= basis[a, k] * gradient[a]
    for a in range(size):
        x[a] = 0.0
        for k in range(size):
            x[a] += basis[a, k] * d[k]
    active[:] = 0.0
    count, joining, excess, weight = 0, -1, 0.0, 0.0
    for _ in range(MOST_TURNS):
        if joining < 0:
            joining, excess = _most_violated(rows, upper, lower, x, active)
            weight = 0.0
            if joining < 0:
                _write_multipliers(members, weights, count, size, multiplier)
                return True
        _against(rows, basis, joining, d)
        free, whole = 0.0, 0.0
        for k in range(size):
            whole += d[k] * d[k]
            free += d[k] * d[k] if k >= count else 0.0
        partial, leaving = np.inf, -1
        for j in range(count - 1, -1, -1):
            r[j] = d[j]
            for k in range(j + 1, count):
                r[j] -= triangle[j, k] * r[k]
            r[j] /= triangle[j, j]
            if r[j] > 0.0 and weights[j] / r[j] < partial:
                partial, leaving = weights[j] / r[j], j
        full = excess / free if free > _DEPENDENT * whole and count < size else np.inf
        length = min(full, partial)
        if not length < np.inf:
            return False
        if full < np.inf:
            for a in range(size):
                for k in range(count, size):
                    x[a] += length * basis[a, k] * d[k]
        for j in range(count):
            weights[j] = max(weights[j] - length * r[j], 0.0)
        weight += length
        if full <= partial:
            _add(basis, triangle, d, count)
            members[count], weights[count] = joining, weight
            active[joining] = 1.0
            count, joining = count + 1, -1
        else:
            active[int(members[leaving])] = 0.0
            _drop(basis, triangle, members, weights, count, leaving)
            count -= 1
            excess = _excess(rows, upper, lower, x, joining)
    return False


@inlined
def _write_multipliers(members: Array, weights: Array, count: int, size: int, multiplier: Array) -> None:
    """Scatter the multipliers of the active constraints into those of all constraints."""
    multiplier[:] = 0.0
    for j in range(count):
        limit = int(members[j])
        if limit < size:
            multiplier[limit] = weights[j]
        elif limit < 2 * size:
            multiplier[limit - size] = -weights[j]
        else:
            multiplier[limit - size] = weights[j]
