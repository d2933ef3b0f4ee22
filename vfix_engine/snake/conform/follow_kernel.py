"""The squares that a followable curve makes small, as a band of a normal matrix; compiled.

A curve is a row of points (n, 3); its unknowns are their coordinates, one point's three after the other's. Each
residual touches points that are at most ``FARTHEST`` apart, so the matrix is a band.
"""

from __future__ import annotations

import math

from ...arrays import Array, IntArray
from ...kernels.compiled import no_refcount

TURN, BEND, CURVE, SPACE, TETHER = range(5)  # columns of the weights, mm per unit of what each multiplies
FARTHEST = 11  # points between the two ends of a chord
BAND = 6 * FARTHEST + 3  # diagonals on and below the main one
_FIXED = 1e3  # holds the first and the last point
_SLIDE = 3  # samples of the centreline that a point's place may move in one turn


@no_refcount
def _add(band: Array, gradient: Array, columns: IntArray, values: Array, count: int, residual: float) -> float:
    """Add the residual with its derivatives to band (BAND, 3n), whose row b holds the entries (j + b, j)."""
    for a in range(count):
        gradient[columns[a]] += values[a] * residual
        for b in range(count):
            below = columns[a] - columns[b]
            if below >= 0:
                band[below, columns[b]] += values[a] * values[b]
    return 0.5 * residual * residual


@no_refcount
def _chord_end(points: Array, start: int, direction: int, chord: float) -> tuple[int, float]:
    """Where a chord from ``start`` ends: the point before its end along ``direction``, and the share; or −1."""
    before, at = 0.0, start
    for _ in range(FARTHEST):
        after = at + direction
        if after < 0 or after >= len(points):
            return -1, 0.0
        away = 0.0
        for k in range(3):
            away += (points[after, k] - points[start, k]) ** 2
        away = math.sqrt(away)
        if away >= chord:
            return at, (chord - before) / (away - before)
        before, at = away, after
    return at - direction, 1.0


@no_refcount
def _turns(
    points: Array,
    chord: float,
    limit: float,
    weight: float,
    band: Array,
    gradient: Array,
    columns: IntArray,
    values: Array,
) -> float:
    """Weight · (turn − limit) where the chords to either side of a point make more than ``limit`` rad."""
    cost = 0.0
    for i in range(len(points)):
        back, u = _chord_end(points, i, -1, chord)
        front, v = _chord_end(points, i, 1, chord)
        if back < 0 or front < 0:
            continue
        aa = bb = ab = 0.0
        for k in range(3):
            a = points[i, k] - (1.0 - u) * points[back, k] - u * points[back - 1, k]
            b = (1.0 - v) * points[front, k] + v * points[front + 1, k] - points[i, k]
            aa, bb, ab = aa + a * a, bb + b * b, ab + a * b
        turn = math.atan2(math.sqrt(max(aa * bb - ab * ab, 0.0)), ab)
        if turn <= limit:
            continue
        la, lb = math.sqrt(aa), math.sqrt(bb)
        c, s = ab / (la * lb), max(math.sin(turn), 1e-3)
        for k in range(3):
            a = (points[i, k] - (1.0 - u) * points[back, k] - u * points[back - 1, k]) / la
            b = ((1.0 - v) * points[front, k] + v * points[front + 1, k] - points[i, k]) / lb
            da, db = weight * (c * a - b) / (s * la), weight * (c * b - a) / (s * lb)
            columns[k], values[k] = 3 * (back - 1) + k, -da * u
            columns[3 + k], values[3 + k] = 3 * back + k, -da * (1.0 - u)
            columns[6 + k], values[6 + k] = 3 * i + k, da - db
            columns[9 + k], values[9 + k] = 3 * front + k, db * (1.0 - v)
            columns[12 + k], values[12 + k] = 3 * (front + 1) + k, db * v
        cost += _add(band, gradient, columns, values, 15, weight * (turn - limit))
    return cost


@no_refcount
def _shape(
    points: Array,
    step: float,
    sharpest: float,
    weights: Array,
    band: Array,
    gradient: Array,
    columns: IntArray,
    values: Array,
) -> float:
    """Even steps, little bending, and none of a smaller radius than ``sharpest``."""
    cost = 0.0
    for i in range(1, len(points)):
        size = 0.0
        for k in range(3):
            size += (points[i, k] - points[i - 1, k]) ** 2
        size = math.sqrt(size)
        for k in range(3):
            columns[k], values[k] = 3 * (i - 1) + k, -weights[SPACE] * (points[i, k] - points[i - 1, k]) / size
            columns[3 + k], values[3 + k] = 3 * i + k, -values[k]
        cost += _add(band, gradient, columns, values, 6, weights[SPACE] * (size - step))
    most = step * step / sharpest
    for i in range(1, len(points) - 1):
        size = 0.0
        for k in range(3):
            second = points[i - 1, k] - 2.0 * points[i, k] + points[i + 1, k]
            size += second * second
            for part in range(3):
                columns[part] = 3 * (i - 1 + part) + k
                values[part] = weights[CURVE] * (-2.0 if part == 1 else 1.0)
            cost += _add(band, gradient, columns, values, 3, weights[CURVE] * second)
        size = math.sqrt(size)
        if size > most:
            for k in range(3):
                second = weights[BEND] * (points[i - 1, k] - 2.0 * points[i, k] + points[i + 1, k]) / size
                for part in range(3):
                    columns[3 * part + k] = 3 * (i - 1 + part) + k
                    values[3 * part + k] = second * (-2.0 if part == 1 else 1.0)
            cost += _add(band, gradient, columns, values, 9, weights[BEND] * (size - most))
    return cost


@no_refcount
def followable_squares(
    points: Array, centre: Array, slack: Array, places: IntArray, chord: float, limit: float, step: float,
    sharpest: float, weights: Array, band: Array, gradient: Array, columns: IntArray, values: Array,
) -> float:  # fmt: skip
    """Half the sum of squares, with band (BAND, 3n) and gradient (3n,) of its Gauss-Newton matrix.

    Args:
        points: (n, 3) mm. centre: (m, 3) the centreline, slack: (m,) how far a point may be from it.
        places: (n,) number of the centreline's sample nearest to every point, where it was and where it is found.
        chord: mm, limit: rad, what two chords in a row may turn. step: mm, wanted. sharpest: mm, radius of a bend.
        weights: (5,); columns: (15,), values: (15,) work.
    """
    for i in range(band.shape[1]):
        gradient[i] = 0.0
        for k in range(band.shape[0]):
            band[k, i] = 0.0
    cost = _turns(points, chord, limit, weights[TURN], band, gradient, columns, values)
    cost += _shape(points, step, sharpest, weights, band, gradient, columns, values)
    for i in range(len(points)):
        least, place = math.inf, places[i]
        for j in range(max(place - _SLIDE, 0), min(place + _SLIDE + 1, len(centre))):
            away = 0.0
            for k in range(3):
                away += (points[i, k] - centre[j, k]) ** 2
            if away < least:
                least, places[i] = away, j
        place, size = places[i], math.sqrt(least)
        for k in range(3):
            columns[k], values[k] = 3 * i + k, weights[TETHER]
            cost += _add(
                band, gradient, columns[k:], values[k:], 1, weights[TETHER] * (points[i, k] - centre[place, k])
            )
        if size > slack[place]:
            for k in range(3):
                values[k] = (points[i, k] - centre[place, k]) / size
            cost += _add(band, gradient, columns, values, 3, size - slack[place])
    last = len(points) - 1
    for k in range(3):
        columns[0], values[0] = k, _FIXED
        cost += _add(band, gradient, columns, values, 1, _FIXED * (points[0, k] - centre[0, k]))
        columns[0] = 3 * last + k
        cost += _add(band, gradient, columns, values, 1, _FIXED * (points[last, k] - centre[len(centre) - 1, k]))
    return cost


@no_refcount
def banded_step(band: Array, gradient: Array, damping: float, factor: Array, move: Array) -> None:
    """Solve (A + damping) move = −gradient for the positive definite A of ``band``, by Cholesky within the band.

    factor: (3n, BAND) work, whose row j holds the entries (j, j) … (j, j − BAND + 1) of the triangle.
    """
    size, wide = len(gradient), len(band)
    for j in range(size):
        first = max(j - wide + 1, 0)
        for i in range(first, j + 1):
            total = band[j - i, i] + (damping if i == j else 0.0)
            for k in range(first, i):
                total -= factor[j, j - k] * factor[i, i - k]
            factor[j, j - i] = math.sqrt(max(total, 1e-12)) if i == j else total / factor[i, 0]
    for j in range(size):
        total = -gradient[j]
        for k in range(max(j - wide + 1, 0), j):
            total -= factor[j, j - k] * move[k]
        move[j] = total / factor[j, 0]
    for j in range(size - 1, -1, -1):
        move[j] /= factor[j, 0]
        for k in range(max(j - wide + 1, 0), j):
            move[k] -= factor[j, j - k] * move[j]
