"""Piecewise polynomial curves by arc length, compiled.

A curve is ``breaks`` (m + 1,) and ``coefficients`` (m, degree + 1, 3), highest power first, about each piece's start.
Its table holds parameters u (n,), arc lengths s (n,) and points (n, 3); each piece starts at an entry.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled

# Gauss-Legendre quadrature with eight nodes on [−1, 1]: exact up to rounding over a step of the table.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@compiled
def _interval(values: Array, x: float) -> int:
    """Index of the interval of increasing values that holds x; clamped to the last interval."""
    low, high = 0, len(values) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if values[middle] <= x:
            low = middle
        else:
            high = middle
    return low


@compiled
def _evaluate(coefficients: Array, x: float, out: Array) -> None:
    """Position, first and second derivative (3, 3) of one piece (degree + 1, 3) at x from its start."""
    out[:, :] = 0.0
    for k in range(len(coefficients)):
        for i in range(3):
            out[2, i] = out[2, i] * x + 2.0 * out[1, i]
            out[1, i] = out[1, i] * x + out[0, i]
            out[0, i] = out[0, i] * x + coefficients[k, i]


@compiled
def _arc(coefficients: Array, x0: float, x1: float, out: Array) -> float:
    """Arc length of one piece between x0 and x1."""
    middle, half, total = 0.5 * (x0 + x1), 0.5 * (x1 - x0), 0.0
    for k in range(len(_NODES)):
        _evaluate(coefficients, middle + half * _NODES[k], out)
        total += _WEIGHTS[k] * np.sqrt(out[1, 0] ** 2 + out[1, 1] ** 2 + out[1, 2] ** 2)
    return total * half


@compiled
def _copy3(into: Array, values: Array) -> None:
    """Copy (3,). Slice assignment would compile numba's shape errors into the kernel, which takes seconds."""
    for j in range(3):
        into[j] = values[j]


@compiled
def arc_table(breaks: Array, coefficients: Array, step: float) -> tuple[Array, Array, Array]:
    """Parameters, arc lengths and points of a table with a spacing of at most ``step`` in the parameter."""
    count = 1
    for m in range(len(coefficients)):
        count += max(int(np.ceil((breaks[m + 1] - breaks[m]) / step)), 4)
    u, s, points, out = np.empty(count), np.zeros(count), np.empty((count, 3)), np.empty((3, 3))
    n = 0
    for m in range(len(coefficients)):
        parts = max(int(np.ceil((breaks[m + 1] - breaks[m]) / step)), 4)
        width = (breaks[m + 1] - breaks[m]) / parts
        for k in range(parts):
            _evaluate(coefficients[m], k * width, out)
            u[n] = breaks[m] + k * width
            _copy3(points[n], out[0])
            s[n + 1] = s[n] + _arc(coefficients[m], k * width, (k + 1) * width, out)
            n += 1
    last = len(coefficients) - 1
    _evaluate(coefficients[last], breaks[last + 1] - breaks[last], out)
    u[n] = breaks[last + 1]
    _copy3(points[n], out[0])
    return u, s, points


@compiled
def parameter_at(breaks: Array, coefficients: Array, u: Array, s: Array, wanted: float, out: Array) -> float:
    """Return the parameter at an arc length, by Newton's method within one interval of the table."""
    begin: float = u[0]
    finish: float = u[-1]
    if wanted <= 0.0:
        return begin
    if wanted >= s[-1]:
        return finish
    i = _interval(s, wanted)
    m = _interval(breaks, u[i])
    start, low, high = u[i] - breaks[m], u[i] - breaks[m], u[i + 1] - breaks[m]
    x = start + (high - start) * (wanted - s[i]) / (s[i + 1] - s[i])
    for _ in range(30):
        off = s[i] + _arc(coefficients[m], start, x, out) - wanted
        if abs(off) <= 1e-13 * (1.0 + s[-1]):
            break
        low, high = (low, x) if off > 0.0 else (x, high)
        _evaluate(coefficients[m], x, out)
        speed = np.sqrt(out[1, 0] ** 2 + out[1, 1] ** 2 + out[1, 2] ** 2)
        x = x - off / speed if speed > 0.0 else low
        if not low < x < high:
            x = 0.5 * (low + high)
    found: float = breaks[m] + x
    return found


@compiled
def _unit_tangent(coefficients: Array, x: float, width: float, out: Array, tangent: Array) -> None:
    """Unit tangent of a piece; where the derivative vanishes, that of a nearby point."""
    _evaluate(coefficients, x, out)
    size = np.sqrt(out[1, 0] ** 2 + out[1, 1] ** 2 + out[1, 2] ** 2)
    if size < 1e-9:
        beside = 1e-5 * width
        _evaluate(coefficients, x + beside if x < 0.5 * width else x - beside, out)
        size = np.sqrt(out[1, 0] ** 2 + out[1, 1] ** 2 + out[1, 2] ** 2)
    for i in range(3):
        tangent[i] = out[1, i] / size


@compiled
def sample(breaks: Array, coefficients: Array, u: Array, s: Array, points: Array, wanted: Array, order: int) -> Array:
    """Positions (order 0) or unit tangents (order 1) at arc lengths (m,): (m, 3)."""
    values, out = np.empty((len(wanted), 3)), np.empty((3, 3))
    for k in range(len(wanted)):
        place = parameter_at(breaks, coefficients, u, s, wanted[k], out)
        m = _interval(breaks, place)
        if order == 0:
            _evaluate(coefficients[m], place - breaks[m], out)
            _copy3(values[k], out[0])
        else:
            _unit_tangent(coefficients[m], place - breaks[m], breaks[m + 1] - breaks[m], out, values[k])
    return values


@compiled
def _half_derivative(coefficients: Array, x: float, target: Array, out: Array) -> tuple[float, float]:
    """First and second derivative of half the squared distance to the target."""
    _evaluate(coefficients, x, out)
    one, two = 0.0, 0.0
    for i in range(3):
        gap = out[0, i] - target[i]
        one += gap * out[1, i]
        two += out[1, i] * out[1, i] + gap * out[2, i]
    return one, two


@compiled
def _refine(coefficients: Array, low: float, high: float, target: Array, out: Array) -> float:
    """Parameter in [low, high] of one piece at which the distance to the target is smallest."""
    if _half_derivative(coefficients, low, target, out)[0] >= 0.0:
        return low
    if _half_derivative(coefficients, high, target, out)[0] <= 0.0:
        return high
    x = 0.5 * (low + high)
    for _ in range(60):
        one, two = _half_derivative(coefficients, x, target, out)
        if one > 0.0:
            high = x
        else:
            low = x
        new = x - one / two if two > 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-13 * (1.0 + abs(x)):
            break
        x = new
    return x


@compiled
def _gap(point: Array, target: Array) -> float:
    x, y, z = point[0] - target[0], point[1] - target[1], point[2] - target[2]
    size: float = np.sqrt(x * x + y * y + z * z)
    return size


@compiled
def closest_on_path(
    breaks: Array, coefficients: Array, u: Array, s: Array, points: Array, target: Array, low: float, high: float
) -> Array:
    """Arc length, point (3) and unit tangent (3) nearest to the target, on the arc from ``low`` to ``high``: (7,)."""
    out, result = np.empty((3, 3)), np.empty(7)
    start = parameter_at(breaks, coefficients, u, s, low, out)
    stop = parameter_at(breaks, coefficients, u, s, high, out)
    first = _interval(u, start)
    last = _interval(u, stop) + 1
    # Every point of an interval is at least half of (the sum of its ends' distances minus its arc length) away. The
    # interval with the smallest lower bound is searched first, so that its result rejects nearly all others.
    lower_bound = np.empty(last - first)
    for i in range(first, last):
        lower_bound[i - first] = 0.5 * (_gap(points[i], target) + _gap(points[i + 1], target) - s[i + 1] + s[i])
    seed = first + int(np.argmin(lower_bound))
    best, where, piece = np.inf, 0.0, 0
    for turn in range(first - 1, last):
        i = seed if turn < first else turn
        if lower_bound[i - first] > best or turn == seed:
            continue
        m = _interval(breaks, u[i])
        x = _refine(coefficients[m], max(u[i], start) - breaks[m], min(u[i + 1], stop) - breaks[m], target, out)
        _evaluate(coefficients[m], x, out)
        gap = _gap(out[0], target)
        if gap < best:
            best, where, piece = gap, x, m
    i = min(max(_interval(u, breaks[piece] + where), first), last - 1)
    if u[i] < breaks[piece]:
        i += 1
    result[0] = s[i] + _arc(coefficients[piece], u[i] - breaks[piece], where, out)
    result[0] = min(max(result[0], low), high)
    _evaluate(coefficients[piece], where, out)
    _copy3(result[1:4], out[0])
    _unit_tangent(coefficients[piece], where, breaks[piece + 1] - breaks[piece], out, result[4:7])
    return result
