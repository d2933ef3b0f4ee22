"""The dual active-set method of Goldfarb and Idnani (1983) for small dense QPs, compiled.

Minimise ½ xᵀH x + fᵀx subject to lower ≤ x ≤ upper and G x ≤ h, H positive definite.
It begins at the minimum without limits and adds one violated limit after the other, dropping those whose multiplier
would turn negative, so that every point on the way is the minimum under the limits it knows.
With H = L Lᵀ the kernel keeps J = L⁻ᵀQ and the triangle R of the active normals N: Jᵀ N = (R; 0).
Its answer is never believed as it is: ``problem_kernel.check_kkt`` checks it like any other solver's.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, BoolArray, IntArray
from ..kernels.compiled import compiled, inlined

MOST_TURNS = 300  # limits added or dropped; the problems of a step need a dozen
_VIOLATED = 1e-9  # in units of the step's length: what is left of a limit by rounding
_DEPENDENT = 1e-20  # squared share of a normal outside of the active ones that is rounding


@inlined
def _inverse_factor(hessian: Array, inverse: Array) -> bool:
    """L⁻ᵀ of H = L Lᵀ as an upper triangle; False where H is not positive definite."""
    size = len(hessian)
    factor = np.zeros((size, size))
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
    """How far x is beyond a limit: the unknowns' upper ones come first, then their lower ones, then the rows'."""
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
def _most_violated(rows: Array, upper: Array, lower: Array, x: Array, active: BoolArray) -> tuple[int, float]:
    """The inactive limit that x is furthest beyond, and how far; −1 where there is none."""
    size = len(x)
    worst, most = -1, _VIOLATED
    for a in range(size):
        above, below = x[a] - upper[a], lower[a] - x[a]
        if not above <= most and not active[a]:
            worst, most = a, above
        if not below <= most and not active[size + a]:
            worst, most = size + a, below
    for i in range(len(rows)):
        excess = -upper[size + i]
        for a in range(size):
            excess += rows[i, a] * x[a]
        if not excess <= most and not active[2 * size + i]:
            worst, most = 2 * size + i, excess
    return worst, most


@inlined
def _against(rows: Array, basis: Array, limit: int, d: Array) -> None:
    """d = −Jᵀ a, a the normal of a limit: the direction off it."""
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


@compiled
def _turn(basis: Array, one: int, two: int, c: float, s: float) -> None:
    """Rotate two columns of J."""
    for i in range(len(basis)):
        a, b = basis[i, one], basis[i, two]
        basis[i, one], basis[i, two] = c * a + s * b, c * b - s * a


@inlined
def _add(basis: Array, triangle: Array, d: Array, count: int) -> None:
    """Make d the column ``count`` of R by rotations that empty its numbers beyond that."""
    for k in range(len(d) - 1, count, -1):
        size = np.hypot(d[k - 1], d[k])
        if size > 0.0:
            c, s = d[k - 1] / size, d[k] / size
            d[k - 1], d[k] = size, 0.0
            _turn(basis, k - 1, k, c, s)
    for k in range(count + 1):
        triangle[k, count] = d[k]


@inlined
def _drop(basis: Array, triangle: Array, members: IntArray, weights: Array, count: int, place: int) -> None:
    """Take column ``place`` out of R and make it a triangle again."""
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
    """Write the minimiser x (c,) and the multipliers (c + m,), positive at an upper limit.

    Args:
        upper, lower: (c + m,) limits of the unknowns, then of the rows; lower ones of rows are not looked at.

    Returns:
        False where H is not positive definite, the limits contradict each other or rounding gets the upper hand.
    """
    size = len(gradient)
    basis, triangle = np.empty((size, size)), np.empty((size, size))
    if not _inverse_factor(hessian, basis):
        return False
    d, r = np.empty(size), np.empty(size)
    for k in range(size):
        d[k] = 0.0
        for a in range(size):
            d[k] -= basis[a, k] * gradient[a]
    for a in range(size):
        x[a] = 0.0
        for k in range(size):
            x[a] += basis[a, k] * d[k]
    active = np.zeros(2 * size + len(rows), np.bool_)
    members, weights = np.empty(size, np.int64), np.empty(size)
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
            active[joining] = True
            count, joining = count + 1, -1
        else:
            active[members[leaving]] = False
            _drop(basis, triangle, members, weights, count, leaving)
            count -= 1
            excess = _excess(rows, upper, lower, x, joining)
    return False


@inlined
def _write_multipliers(members: IntArray, weights: Array, count: int, size: int, multiplier: Array) -> None:
    """The multipliers of all limits from those of the active ones."""
    multiplier[:] = 0.0
    for j in range(count):
        limit = members[j]
        if limit < size:
            multiplier[limit] = weights[j]
        elif limit < 2 * size:
            multiplier[limit - size] = -weights[j]
        else:
            multiplier[limit - size] = weights[j]
