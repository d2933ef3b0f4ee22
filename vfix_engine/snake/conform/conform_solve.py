"""Damped Gauss-Newton steps in a box of joint angles; compiled.

The step in the box is a projected Newton method: D. P. Bertsekas, "Projected Newton methods for optimization problems
with simple constraints", SIAM Journal on Control and Optimization 20(2), 1982.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled, no_refcount
from .conform_kernel import Body, ChainTask, CurveSamples, normal_matrix, shape_cost

_TURNS = 30  # of one step's set of joints at a limit
_SMALL = 1e-9  # [rad, mm] a shorter step counts as zero
_TOUCHES = 1e-12  # [rad, mm] distance from a limit that counts as at it
_GAIN = 1e-5  # fraction of the cost; a smaller improvement ends the iteration
_NOTHING = 1e-18  # [mm²] a lower cost counts as zero
_FLOOR, _STIFFEST = 1e-6, 1e6  # of the damping


@no_refcount
def _newton(hessian: Array, slope: Array, free: IntArray, count: int, factor: Array, step: Array) -> None:
    """Newton's step for the ``count`` unknowns of ``free``, 0 for the others; the matrix is positive definite."""
    for a in range(count):
        for b in range(a + 1):
            total = hessian[free[a], free[b]]
            for k in range(b):
                total -= factor[a, k] * factor[b, k]
            factor[a, b] = math.sqrt(max(total, 1e-12)) if a == b else total / factor[b, b]
    for i in range(len(step)):
        step[i] = 0.0
    for a in range(count):
        total = -slope[free[a]]
        for k in range(a):
            total -= factor[a, k] * step[free[k]]
        step[free[a]] = total / factor[a, a]
    for a in range(count - 1, -1, -1):
        total = step[free[a]]
        for k in range(a + 1, count):
            total -= factor[k, a] * step[free[k]]
        step[free[a]] = total / factor[a, a]


@no_refcount
def _value(hessian: Array, gradient: Array, x: Array, slope: Array) -> float:
    """½ xᵀH x + gᵀx, and its slope H x + g."""
    total = 0.0
    for i in range(len(x)):
        row = 0.0
        for k in range(len(x)):
            row += hessian[i, k] * x[k]
        slope[i] = row + gradient[i]
        total += x[i] * (0.5 * row + gradient[i])
    return total


@no_refcount
def _free_step(
    hessian: Array, slope: Array, x: Array, lower: Array, upper: Array, factor: Array, free: IntArray, step: Array
) -> None:
    """Newton's step for unknowns that neither their slope nor the step itself fixes at a limit."""
    count = 0
    for i in range(len(x)):
        held = (x[i] <= lower[i] and slope[i] >= 0.0) or (x[i] >= upper[i] and slope[i] <= 0.0)
        if not held:
            free[count] = i
            count += 1
    while count > 0:
        _newton(hessian, slope, free, count, factor, step)
        left = 0
        for a in range(count):
            i = free[a]
            if not ((x[i] <= lower[i] and step[i] < 0.0) or (x[i] >= upper[i] and step[i] > 0.0)):
                free[left] = i
                left += 1
        if left == count:
            return
        count = left
    for i in range(len(x)):
        step[i] = 0.0


@no_refcount
def box_step(
    hessian: Array, gradient: Array, lower: Array, upper: Array, factor: Array, vectors: Array, free: IntArray, x: Array
) -> None:
    """The x (n,) between ``lower`` ≤ 0 ≤ ``upper`` of least ½ xᵀH x + gᵀx; vectors: (3, n) and free: (n,) work.

    A step that leaves the box is clamped component by component; where that does not reduce the cost, it ends at the
    first limit.
    """
    slope, step, trial = vectors[0], vectors[1], vectors[2]
    for i in range(len(x)):
        x[i] = 0.0
    value = _value(hessian, gradient, x, slope)
    for _ in range(_TURNS):
        _free_step(hessian, slope, x, lower, upper, factor, free, step)
        largest, first = 0.0, 1.0
        for i in range(len(x)):
            trial[i] = min(max(x[i] + step[i], lower[i]), upper[i])
            largest = max(largest, abs(trial[i] - x[i]))
            if x[i] + step[i] < lower[i]:
                first = min(first, (lower[i] - x[i]) / step[i])
            elif x[i] + step[i] > upper[i]:
                first = min(first, (upper[i] - x[i]) / step[i])
        if largest < _SMALL:
            break
        lowered = _value(hessian, gradient, trial, slope)
        if not lowered < value:
            for i in range(len(x)):
                ahead = x[i] + first * step[i]
                # Exactly on the limit that was reached, not a rounding error before it.
                trial[i] = min(max(ahead, lower[i]), upper[i])
                if step[i] < 0.0 and trial[i] - lower[i] < _TOUCHES:
                    trial[i] = lower[i]
                elif step[i] > 0.0 and upper[i] - trial[i] < _TOUCHES:
                    trial[i] = upper[i]
            lowered = _value(hessian, gradient, trial, slope)
            if not lowered < value:
                break
        value = lowered
        for i in range(len(x)):
            x[i] = trial[i]


@no_refcount
def _bounds(state: Array, low: Array, high: Array, lower: Array, upper: Array) -> None:
    """Remaining range of every unknown."""
    for i in range(len(state)):
        lower[i], upper[i] = min(low[i] - state[i], 0.0), max(high[i] - state[i], 0.0)


@no_refcount
def _copied(source: Array, out: Array) -> None:
    for i in range(len(source)):
        out[i] = source[i]


@no_refcount
def _damped(hessian: Array, damping: float, out: Array) -> None:
    for i in range(len(hessian)):
        for k in range(len(hessian)):
            out[i, k] = hessian[i, k]
        out[i, i] += damping * hessian[i, i] + _FLOOR


@compiled
def settle_chain(
    line: CurveSamples,
    task: ChainTask,
    low: Array,
    high: Array,
    turns: int,
    state: Array,
    places: Array,
    base: Array,
    frames: Array,
) -> float:
    """Move a state (2L + 1,), angles and feed, to less cost between ``low`` and ``high``; the cost it ends with.

    places (2L,), base (3, 4) and frames (L, 3, 4) are those of the result.
    """
    links, size = len(frames), len(state)
    body = Body(base, frames, np.empty((links, 6)), np.empty((links, 6, 6)), np.empty((7, 3)))
    hessian, damped, factor = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    gradient, lower, upper, x = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    twists, moved, vectors, free = np.empty((size, 6)), np.empty(6), np.empty((3, size)), np.empty(size, np.int64)
    trial, tried = np.empty(size), np.empty(len(places))
    for i in range(size):
        state[i] = min(max(state[i], low[i]), high[i])
    cost = shape_cost(line, task, state, places, body)
    damping, fresh = _FLOOR, True
    for _ in range(turns):
        if fresh:
            normal_matrix(line, task, body, state, twists, moved, gradient, hessian)
        _damped(hessian, damping, damped)
        _bounds(state, low, high, lower, upper)
        box_step(damped, gradient, lower, upper, factor, vectors, free, x)
        largest = 0.0
        for i in range(size):
            trial[i] = min(max(state[i] + x[i], low[i]), high[i])
            largest = max(largest, abs(x[i]))
        _copied(places, tried)
        new = shape_cost(line, task, trial, tried, body)
        fresh = new < cost
        if fresh:
            gain, cost = cost - new, new
            _copied(trial, state)
            _copied(tried, places)
            damping = max(0.2 * damping, _FLOOR)
            if gain <= _GAIN * cost + _NOTHING and damping < 1e-2:
                break
        else:
            damping = max(10.0 * damping, 1e-3)
            if largest < _SMALL or damping > _STIFFEST:
                break
    return shape_cost(line, task, state, places, body)
