"""The search for the bend of least cost within the bounds, compiled: Kwok 2013, eq. 14-20, section IV.B.

What depends on the bend alone, its cost, costs next to nothing; what is counted are evaluations of the query. A bend is
to be reached from rest by growing along its ray of (a, b), so what a ray offers ends where it first leaves the pathway.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, compiled
from .bending_kernel import FARTHEST, HIGH, LOW, RAYS, Lumen, Scratch, cost_of, judge

Array = NDArray[np.float64]

_STEPS = 24  # along a ray, in which its cost is looked at
_HALVINGS = 7  # of such a step
_EXITS = 8  # evaluations at most for the place where a ray leaves the pathway
_CHECKS = 7  # places on the way to the bend that is given, asked in the end
_REPAIR = 5  # more, where one of them is beyond the bounds
_COARSE, _FINE = 2e-3, 1e-4  # a record is to be bettered by so much of z_max
_NARROW = 1e-3  # [rad] directions closer than that are not told apart


@borrowing
def along(rest: Array, plane: Array, aims: Array, phi: float, target: float, scratch: Scratch) -> tuple[float, float]:
    """Where a ray's cost first falls to ``target``, and where from there on it is least; negative if it does not."""
    u, v = math.cos(phi), math.sin(phi)
    step = aims[FARTHEST] / _STEPS
    first, least, lowest = -1.0, -1.0, math.inf
    for k in range(1, _STEPS + 1):
        r = k * step
        cost = cost_of(rest, plane, aims, r * u, r * v, scratch)
        if first < 0.0 and cost <= target:
            low, first = r - step, r
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + first)
                if cost_of(rest, plane, aims, middle * u, middle * v, scratch) <= target:
                    first = middle
                else:
                    low = middle
            least, lowest = first, target
        if first >= 0.0 and cost < lowest:
            least, lowest = r, cost
    return first, least


@borrowing
def leave(
    lumen: Lumen,
    bound: Array,
    rest: Array,
    plane: Array,
    aims: Array,
    phi: float,
    low: float,
    g_low: float,
    high: float,
    left: int,
    scratch: Scratch,
) -> tuple[float, int]:
    """How far along a ray the bounds are kept, from ``low``, which keeps them by −g_low, to ``high``; evaluations.

    By false position on the excess (Illinois), which below the bound is known as well as above.
    """
    u, v = math.cos(phi), math.sin(phi)
    g_high, r, made, before = math.inf, high, 0, 0
    while made < min(left, _EXITS):
        g = judge(lumen, bound, rest, plane, aims, r * u, r * v, scratch)
        made += 1
        if g <= 0.0:
            if made == 1:
                return r, made
            g_high *= 0.5 if before == 1 else 1.0
            low, g_low, before = r, g, 1
        else:
            g_low *= 0.5 if before == 2 else 1.0
            high, g_high, before = r, g, 2
        if high - low < 2e-3 * high:
            break
        share = g_low / (g_low - g_high) if g_low < g_high < math.inf else 0.5
        r = low + min(max(share, 0.08), 0.92) * (high - low)
    return low, made


@borrowing
def walk(
    lumen: Lumen, bound: Array, rest: Array, plane: Array, aims: Array, phi: float, r: float, scratch: Scratch
) -> tuple[float, int]:
    """The way to a bend, asked here and there: how far it is within the bounds, r itself as a rule; evaluations."""
    u, v = math.cos(phi), math.sin(phi)
    for k in range(1, _CHECKS + 1):
        to = r * k / (_CHECKS + 1)
        if judge(lumen, bound, rest, plane, aims, to * u, to * v, scratch) <= 0.0:
            continue
        low = r * (k - 1) / (_CHECKS + 1)
        for _ in range(_REPAIR):
            middle = 0.5 * (low + to)
            if judge(lumen, bound, rest, plane, aims, middle * u, middle * v, scratch) <= 0.0:
                low = middle
            else:
                to = middle
        return low, k + _REPAIR
    return r, _CHECKS


@borrowing
def direction(aims: Array, number: int) -> float:
    """The direction of that number: from the middle outwards, left and right in turn."""
    count = int(aims[RAYS])
    away = (number + 1) // 2 if number % 2 == 1 else -(number // 2)
    middle: float = 0.5 * (aims[LOW] + aims[HIGH])
    width: float = (aims[HIGH] - aims[LOW]) / count
    return middle + (away - 0.5 * (1 - count % 2)) * width


@compiled
def search(
    lumen: Lumen, bound: Array, rest: Array, plane: Array, aims: Array, evaluations: int, scratch: Scratch
) -> tuple[float, float, float, int]:
    """a and b of the bend of least cost that is within the bounds (L',) in mm; its cost; evaluations made.

    Each direction is asked first at the one place where its cost falls below the record's: where that is beyond the
    bounds it cannot better the record, and took one evaluation. Directions are tried all over, then ever closer to
    the best. The rest itself has to be within the bounds.
    """
    record, best, best_phi = 1.0, 0.0, 0.0
    spent = evaluations - _CHECKS - _REPAIR
    step = (aims[HIGH] - aims[LOW]) / aims[RAYS]
    made, tried, side, better = 0, 0, 0, True
    while made < spent and step > _NARROW:
        demand = _COARSE
        if tried < aims[RAYS]:
            phi = direction(aims, tried)
            tried += 1
        else:
            if side == 2:
                side, step, better = 0, step if better else 0.5 * step, False
            demand = _FINE
            phi = best_phi + (0.5 - side) * step
            side += 1
            if best == 0.0:
                break
        if not aims[LOW] < phi < aims[HIGH]:
            continue
        low, high = along(rest, plane, aims, phi, record - demand, scratch)
        if low < 0.0:
            continue
        g = judge(lumen, bound, rest, plane, aims, low * math.cos(phi), low * math.sin(phi), scratch)
        made += 1
        if g <= 0.0:
            low, more = leave(lumen, bound, rest, plane, aims, phi, low, g, high, spent - made, scratch)
            made += more
            best, best_phi, better = low, phi, True
            record = cost_of(rest, plane, aims, low * math.cos(phi), low * math.sin(phi), scratch)
    if best == 0.0:
        return 0.0, 0.0, 1.0, made
    reached, more = walk(lumen, bound, rest, plane, aims, best_phi, best, scratch)
    a, b = reached * math.cos(best_phi), reached * math.sin(best_phi)
    if reached == 0.0:
        return 0.0, 0.0, 1.0, made + more
    return a, b, cost_of(rest, plane, aims, a, b, scratch), made + more


@compiled
def survey(
    lumen: Lumen,
    bound: Array,
    rest: Array,
    plane: Array,
    aims: Array,
    phi: Array,
    steps: int,
    exits: Array,
    scratch: Scratch,
) -> tuple[float, float, float, float, float, float]:
    """Every direction ``phi`` (n,) asked at ``steps`` places: the best bend a, b, cost before its ray's first exit.

    And the best one that may lie beyond an exit too. ``exits`` (n,) gets where each ray leaves the bounds first, found
    to 1e-6 of the farthest, or the farthest.
    """
    best_a, best_b, best, any_a, any_b, least = 0.0, 0.0, 1.0, 0.0, 0.0, 1.0
    for i in range(len(phi)):
        u, v = math.cos(phi[i]), math.sin(phi[i])
        exits[i], inside = aims[FARTHEST], True
        for k in range(1, steps + 1):
            r = aims[FARTHEST] * k / steps
            kept = judge(lumen, bound, rest, plane, aims, r * u, r * v, scratch) <= 0.0
            if inside and not kept:
                low, high, inside = r - aims[FARTHEST] / steps, r, False
                while high - low > 1e-6 * aims[FARTHEST]:
                    middle = 0.5 * (low + high)
                    if judge(lumen, bound, rest, plane, aims, middle * u, middle * v, scratch) <= 0.0:
                        low = middle
                    else:
                        high = middle
                exits[i] = low
                cost = cost_of(rest, plane, aims, low * u, low * v, scratch)
                if cost < best:
                    best_a, best_b, best = low * u, low * v, cost
            if kept:
                cost = cost_of(rest, plane, aims, r * u, r * v, scratch)
                if cost < least:
                    any_a, any_b, least = r * u, r * v, cost
                if inside and cost < best:
                    best_a, best_b, best = r * u, r * v, cost
    return best_a, best_b, best, any_a, any_b, min(least, best)
