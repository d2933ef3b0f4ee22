"""The search for the bend of least cost within the bounds, compiled: Kwok 2013, eq. 14-20, section IV.B.

What depends on the bend alone, its cost, costs next to nothing; what is counted are evaluations of the query. A bend is
to be reached from rest by growing along its ray of (a, b), so what a ray offers ends where it first leaves the pathway.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, compiled
from .bending_kernel import FARTHEST, HIGH, LOW, Lumen, Scratch, cost_of, judge

Array = NDArray[np.float64]

# Directions of a first look, t of ``direction``. In no order of theirs, so that few of them better the record.
_LOOKS = (0.0, 6.0, -6.0, 3.0, -3.0, 5.0, -5.0, 2.0, -2.0, 7.0, -7.0, 4.0, -4.0, 1.0, -1.0, 8.0, -8.0)
UTMOST = 10.0  # |t| at most
_STEPS = 24  # along a ray, in which its cost is looked at
_HALVINGS = 7  # of such a step
_EXITS = 14  # evaluations at most for the place where a ray leaves the pathway
_STRIDE = 1.3  # to the next place where it may do so
_DEEP = 20.0  # [mm] an excess counts for no more: far outside it says little
_GLANCES = 3  # places on the way to a bend in a direction of the first look
_CHECKS = 7  # places on the way to the bend that is given, asked in the end
_REPAIR = 5  # more, where one of them is beyond the bounds
_COARSE, _FINE = 5e-3, 2e-4  # a record is to be bettered by so much of z_max, and is known as well
_NARROW = 1.0 / 256.0  # of t: directions closer than that are not told apart


@borrowing
def direction(aims: Array, t: float) -> float:
    """The angle of a ray in the plane of (a, b): the middle at t = 0, and half as far from the edge with each 1 of t.

    What can be reached is long and narrow: a bend to and fro, which leaves the tip in the middle, may be large, and it
    lies by the edge of the half plane in which the tip goes the wanted way.
    """
    half = 0.5 * (aims[HIGH] - aims[LOW])
    away: float = half * (1.0 - 2.0 ** -abs(t))
    middle: float = aims[LOW] + half
    return middle + away if t > 0.0 else middle - away


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
    worth: float,
    left: int,
    scratch: Scratch,
) -> tuple[float, int]:
    """How far along a ray the bounds are kept, from ``low``, which keeps them by −g_low, to ``high``; evaluations.

    In growing strides up to the first place that does not keep them, as there may be others beyond that do; then by
    false position on the excess (Illinois), which below the bound is known as well as above, until what is left is
    worth no more than that in cost.
    """
    u, v = math.cos(phi), math.sin(phi)
    g_high, made, before = math.inf, 0, 0
    while made < min(left, _EXITS) and low < high:
        r = min(low * _STRIDE, high)
        if g_high < math.inf:
            share = g_low / (g_low - g_high)
            r = low + min(max(share, 0.08), 0.92) * (high - low)
        g = judge(lumen, bound, rest, plane, aims, r * u, r * v, scratch)
        made += 1
        if g <= 0.0:
            g_high *= 0.5 if before == 1 else 1.0
            low, g_low, before = r, g, 1
        else:
            g_low *= 0.5 if before == 2 else 1.0
            high, g_high, before = r, min(g, _DEEP), 2
        gain = cost_of(rest, plane, aims, low * u, low * v, scratch)
        gain -= cost_of(rest, plane, aims, high * u, high * v, scratch)
        if abs(gain) < worth or high - low < 1e-6 * high:
            break
    return low, made


@borrowing
def walk(
    lumen: Lumen,
    bound: Array,
    rest: Array,
    plane: Array,
    aims: Array,
    phi: float,
    r: float,
    places: int,
    repair: int,
    scratch: Scratch,
) -> tuple[float, int]:
    """The way to a bend, asked at some places: how far it is within the bounds, r itself as a rule; evaluations.

    Where it is not, its end is brought closer by so many more.
    """
    u, v = math.cos(phi), math.sin(phi)
    for k in range(1, places + 1):
        to = r * k / (places + 1)
        if judge(lumen, bound, rest, plane, aims, to * u, to * v, scratch) <= 0.0:
            continue
        low = r * (k - 1) / (places + 1)
        for _ in range(repair):
            middle = 0.5 * (low + to)
            if judge(lumen, bound, rest, plane, aims, middle * u, middle * v, scratch) <= 0.0:
                low = middle
            else:
                to = middle
        return low, k + repair
    return r, places


@compiled
def search(
    lumen: Lumen, bound: Array, rest: Array, plane: Array, aims: Array, evaluations: int, scratch: Scratch
) -> tuple[float, float, float, int]:
    """a and b of the bend of least cost that is within the bounds (L',) in mm; its cost; evaluations made.

    Each direction is asked first at the one place where its cost falls below the record's: where that is beyond the
    bounds it cannot better the record, and took one evaluation. Directions are tried all over, then ever closer to
    the best. The rest itself has to be within the bounds.
    """
    record, best, best_t = 1.0, 0.0, 0.0
    spent = evaluations - _CHECKS - _REPAIR
    made, tried, side, step, better = 0, 0, 2, 1.0, False
    while made < spent and step >= _NARROW:
        demand = _COARSE
        if tried < len(_LOOKS):
            t = _LOOKS[tried]
            tried += 1
        elif best == 0.0:
            break
        else:
            if side == 2:
                side, step, better = 0, step if better else 0.5 * step, False
            demand = _FINE
            t = best_t + (step if side == 0 else -step)
            side += 1
        if abs(t) > UTMOST:
            continue
        phi = direction(aims, t)
        u, v = math.cos(phi), math.sin(phi)
        low, high = along(rest, plane, aims, phi, record - demand, scratch)
        if low < 0.0:
            continue
        g = judge(lumen, bound, rest, plane, aims, low * u, low * v, scratch)
        made += 1
        if g <= 0.0 and tried <= len(_LOOKS) and side == 2:
            reached, more = walk(lumen, bound, rest, plane, aims, phi, low, _GLANCES, 0, scratch)
            made += more
            g = g if reached == low else math.inf
        if g <= 0.0:
            low, more = leave(lumen, bound, rest, plane, aims, phi, low, g, high, demand, spent - made, scratch)
            made += more
            best, best_t, better = low, t, True
            record = cost_of(rest, plane, aims, low * u, low * v, scratch)
    if best == 0.0:
        return 0.0, 0.0, 1.0, made
    best_phi = direction(aims, best_t)
    reached, more = walk(lumen, bound, rest, plane, aims, best_phi, best, _CHECKS, _REPAIR, scratch)
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
    places: Array,
    steps: int,
    exits: Array,
    scratch: Scratch,
) -> tuple[float, float, float, float, float, float, float]:
    """Every direction ``places`` (n,), t of ``direction``, asked at ``steps`` places along its ray.

    a, b and cost of the best bend before its ray's first exit, then of the best that may lie beyond one, then t of the
    first. ``exits`` (n,) gets where each ray first leaves the bounds, to 1e-6 of the farthest, or the farthest.
    """
    best_a, best_b, best, any_a, any_b, least, at = 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0
    for i in range(len(places)):
        phi = direction(aims, places[i])
        u, v = math.cos(phi), math.sin(phi)
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
                    best_a, best_b, best, at = low * u, low * v, cost, places[i]
            if kept:
                cost = cost_of(rest, plane, aims, r * u, r * v, scratch)
                if cost < least:
                    any_a, any_b, least = r * u, r * v, cost
                if inside and cost < best:
                    best_a, best_b, best, at = r * u, r * v, cost, places[i]
    return best_a, best_b, best, any_a, any_b, min(least, best), at
