"""The search for the bend of least cost within the bounds, compiled: Kwok 2013, eq. 14-20, section IV.B.

What depends on the bend alone, its cost, costs next to nothing; what is counted are evaluations of the query. A bend is
to be reached from rest by growing along its ray of (a, b), so what a ray offers ends where it first leaves the pathway.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...kernels.compiled import compiled, no_refcount
from .bending_kernel import BendWorkspace, DistalPathway, Family, cost_of, excess_of

# Of a search's state: cost, radius and t of the record, and of the last one whose path was checked; evaluations; t
# between which directions are tried; radii at which paths were found narrow
RECORD, BEST, AT, SAFE, MADE, LEAST, MOST, NARROW = 0, 1, 2, 3, 6, 7, 8, 9
_NARROWS = 3
STATE = NARROW + _NARROWS

# Directions of a first look, t of ``direction``. In no order of theirs, so that few of them better the record.
_LOOKS = (
    3.5, -3.5, 0.0, 4.5, 2.5, -2.5, -4.5, 5.5, 1.5, -1.5, -5.5, 6.5, 0.75, -0.75, -6.5, 7.5, -7.5,
    0.25, -0.25, 1.0, -1.0, 2.0, -2.0, 8.5, -8.5, 3.0, -3.0, 4.0, -4.0, 9.5, -9.5, 5.0, -5.0, 6.0, -6.0,
)  # fmt: skip
_FIRST_LOOK = 17  # of them; the others where evaluations are left
UTMOST = 10.0  # |t| at most
_STEPS = 24  # along a ray, in which its cost is looked at
_HALVINGS = 7  # of such a step
_EXITS = 14  # evaluations at most for the place where a ray leaves the pathway
_STRIDE, _STRIDE_LEAST = 1.3, 0.025  # to the next place where it may do so: of the radius, of the farthest
_DEEP = 20.0  # [mm] an excess counts for no more: far outside it says little
_GLANCES = 2  # places on the path to a bend in a direction of the first look
_DIRECTION = 6  # evaluations at most to find that a direction betters the record
_CHECKS = 7  # places on the path to the bend that is given, asked in the end
_REPAIR = 4  # more, where one of them is beyond the bounds
_COARSE, _FINE = 1e-2, 2e-4  # a record is to be bettered by so much of z_max, and is known as well
_CLOSER, _CLOSEST = 1.0 / 16.0, 1.0 / 128.0  # of t: then the path is checked, and what is not distinguished any more


@no_refcount
def direction(family: Family, t: float) -> float:
    """The angle of a ray in the plane of (a, b): the middle at t = 0, and half as far from the edge with each 1 of t.

    What can be reached is long and narrow: a bend to and fro, which leaves the tip in the middle, may be large, and it
    lies by the edge of the half plane in which the tip goes in the wanted direction.
    """
    half = 0.5 * (family.high - family.low)
    away: float = half * (1.0 - 2.0 ** -abs(t))
    middle: float = family.low + half
    return middle + away if t > 0.0 else middle - away


@no_refcount
def along(
    lumen: DistalPathway, family: Family, phi: float, target: float, scratch: BendWorkspace
) -> tuple[float, float]:
    """Where a ray's cost first falls to ``target``, and where from there on it is least; negative if it does not."""
    u, v = math.cos(phi), math.sin(phi)
    step = family.farthest / _STEPS
    first, least, lowest = -1.0, -1.0, math.inf
    for k in range(1, _STEPS + 1):
        r = k * step
        cost = cost_of(lumen, family, r * u, r * v, scratch)
        if first < 0.0 and cost <= target:
            low, first = r - step, r
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + first)
                if cost_of(lumen, family, middle * u, middle * v, scratch) <= target:
                    first = middle
                else:
                    low = middle
            least, lowest = first, target
        if first >= 0.0 and cost < lowest:
            least, lowest = r, cost
    return first, least


@no_refcount
def exit_distance(
    lumen: DistalPathway,
    family: Family,
    phi: float,
    low: float,
    g_low: float,
    high: float,
    worth: float,
    left: int,
    scratch: BendWorkspace,
) -> tuple[float, int]:
    """How far along a ray the bounds are kept, from ``low``, which keeps them by −g_low, to ``high``; evaluations.

    In growing strides up to the first place that does not keep them, as there may be others beyond that do; then by
    false position on the excess (Illinois), which below the bound is known as well as above, until what is left is
    worth no more than that in cost.
    """
    u, v = math.cos(phi), math.sin(phi)
    g_high, made, before = math.inf, 0, 0
    while made < min(left, _EXITS) and low < high:
        r = min(max(low * _STRIDE, low + _STRIDE_LEAST * family.farthest), high)
        if g_high < math.inf:
            share = g_low / (g_low - g_high)
            r = low + min(max(share, 0.08), 0.92) * (high - low)
        g = excess_of(lumen, family, r * u, r * v, False, scratch)
        made += 1
        if g <= 0.0:
            g_high *= 0.5 if before == 1 else 1.0
            low, g_low, before = r, g, 1
        else:
            g_low *= 0.5 if before == 2 else 1.0
            high, g_high, before = r, min(g, _DEEP), 2
        gain = cost_of(lumen, family, low * u, low * v, scratch)
        gain -= cost_of(lumen, family, high * u, high * v, scratch)
        if abs(gain) < worth or high - low < 1e-6 * high:
            break
    return low, made


@no_refcount
def check_path(
    lumen: DistalPathway,
    family: Family,
    phi: float,
    r: float,
    places: int,
    repair: int,
    scratch: BendWorkspace,
) -> tuple[float, float, int]:
    """The path to a bend, measured at some places: how far it is within the bounds, r itself as a rule; evaluations.

    Where it is not, its end is brought closer by so many more. Between the two, the place that is the deepest: -1 where
    all are as deep as nothing is.
    """
    u, v = math.cos(phi), math.sin(phi)
    weak, most, least = -1.0, -math.inf, math.inf
    for k in range(1, places + 1):
        to = r * k / (places + 1)
        g = excess_of(lumen, family, to * u, to * v, True, scratch)
        least = min(least, g)
        if g > most:
            weak, most = to, g
        if g <= 0.0:
            continue
        low = r * (k - 1) / (places + 1)
        for _ in range(repair):
            middle = 0.5 * (low + to)
            if excess_of(lumen, family, middle * u, middle * v, True, scratch) <= 0.0:
                low = middle
            else:
                to = middle
        return low, weak, k + repair
    return r, weak if most > least else -1.0, places


@no_refcount
def try_direction(
    lumen: DistalPathway,
    family: Family,
    t: float,
    demand: float,
    glances: int,
    spent: int,
    state: Array,
    scratch: BendWorkspace,
) -> bool:
    """Whether a direction betters the record by ``demand``; it is the record then, as far as it goes.

    It is asked first at the one place where its cost falls so low, then at the radii where paths were found narrow,
    then at a few places of its path.
    """
    if not state[LEAST] <= t <= state[MOST]:
        return False
    phi = direction(family, t)
    u, v = math.cos(phi), math.sin(phi)
    low, high = along(lumen, family, phi, state[RECORD] - demand, scratch)
    if low < 0.0:
        return False
    g = excess_of(lumen, family, low * u, low * v, True, scratch)
    state[MADE] += 1
    if not g <= 0.0:
        return False
    for k in range(_NARROWS):
        weak = state[NARROW + k]
        if 0.0 < weak < low:
            state[MADE] += 1
            if not excess_of(lumen, family, weak * u, weak * v, True, scratch) <= 0.0:
                return False
    reached, weak, made = check_path(lumen, family, phi, low, glances, 0, scratch)
    state[MADE] += made
    if reached < low:
        return False
    low, made = exit_distance(lumen, family, phi, low, g, high, demand, spent - int(state[MADE]), scratch)
    state[MADE] += made
    state[BEST], state[AT], state[RECORD] = low, t, cost_of(lumen, family, low * u, low * v, scratch)
    return True


@no_refcount
def check_record(lumen: DistalPathway, family: Family, state: Array, scratch: BendWorkspace) -> bool:
    """Check the path to the record: whether all of it is within the bounds.

    If not, the record is what comes before, or the last one whose path was checked, whichever is better; in the latter
    case no direction is tried any more that is nearer to the refused one. The deepest place of the path is kept, as
    paths close to this one are as a rule narrow at the same radius.
    """
    phi = direction(family, state[AT])
    reached, weak, made = check_path(lumen, family, phi, state[BEST], _CHECKS, _REPAIR, scratch)
    whole: bool = reached == state[BEST]
    state[MADE] += made
    if weak > 0.0:
        for k in range(_NARROWS - 1, 0, -1):
            state[NARROW + k] = state[NARROW + k - 1]
        state[NARROW] = weak
    if not whole:
        cost = cost_of(lumen, family, reached * math.cos(phi), reached * math.sin(phi), scratch)
        state[RECORD], state[BEST] = cost, reached
        if not cost < state[SAFE]:
            if state[SAFE + BEST] > 0.0:
                end = MOST if state[AT] > state[SAFE + AT] else LEAST
                state[end] = 0.5 * (state[AT] + state[SAFE + AT])
            for k in range(3):
                state[k] = state[SAFE + k]
    for k in range(3):
        state[SAFE + k] = state[k]
    return whole


@no_refcount
def refine(
    lumen: DistalPathway,
    family: Family,
    finest: float,
    spent: int,
    state: Array,
    scratch: BendWorkspace,
) -> bool:
    """Directions ever closer to the best, until they differ by ``finest`` in t: whether one betters the record."""
    step, turned, better = 0.5, 0, False
    while state[MADE] <= spent - _DIRECTION and step >= finest:
        t = state[AT] + (step if turned % 2 == 0 else -step)
        if try_direction(lumen, family, t, max(_FINE, _COARSE * step), 0, spent, state, scratch):
            turned, better = 0, True
            continue
        turned += 1
        if turned == 2:
            step, turned = 0.5 * step, 0
    return better


@compiled
def search(
    lumen: DistalPathway, family: Family, evaluations: int, scratch: BendWorkspace
) -> tuple[float, float, float, int]:
    """a and b of the bend of least cost that is within the bounds (L',) in mm; its cost; evaluations made.

    Directions are tried all over, then ever closer to the best; where evaluations are left, the same with others
    between them. Each is one evaluation as long as it does not better the record. The path to the best is checked now
    and then; if it leaves the bounds, the search goes on from the best that does not. The rest itself has to be within
    the bounds.
    """
    state = np.zeros(STATE)
    state[RECORD], state[SAFE] = 1.0, 1.0
    spent = evaluations - _CHECKS - _REPAIR  # kept for the last check
    for first, last in ((0, _FIRST_LOOK), (_FIRST_LOOK, len(_LOOKS))):
        state[LEAST], state[MOST] = -UTMOST, UTMOST
        better = False
        for k in range(first, last):
            if state[MADE] <= spent - _DIRECTION:
                better |= try_direction(lumen, family, _LOOKS[k], _COARSE, _GLANCES, spent, state, scratch)
        finest = _CLOSER
        while better and state[BEST] > 0.0 and state[MADE] <= spent:
            whole = check_record(lumen, family, state, scratch)
            better = refine(lumen, family, finest, spent, state, scratch) or not whole
            better, finest = better or finest > _CLOSEST, _CLOSEST
    phi = direction(family, state[SAFE + AT])
    r = state[SAFE + BEST]
    return r * math.cos(phi), r * math.sin(phi), state[SAFE + RECORD], int(state[MADE])


@compiled
def survey(
    lumen: DistalPathway,
    family: Family,
    places: Array,
    steps: int,
    exits: Array,
    scratch: BendWorkspace,
) -> tuple[float, float, float, float, float, float, float]:
    """Every direction ``places`` (n,), t of ``direction``, asked at ``steps`` places along its ray.

    a, b and cost of the best bend before its ray's first exit, then of the best that may lie beyond one, then t of the
    first. ``exits`` (n,) gets where each ray first leaves the bounds, to 1e-6 of the farthest, or the farthest.
    """
    best_a, best_b, best, any_a, any_b, least, at = 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0
    for i in range(len(places)):
        phi = direction(family, places[i])
        u, v = math.cos(phi), math.sin(phi)
        exits[i], inside = family.farthest, True
        for k in range(1, steps + 1):
            r = family.farthest * k / steps
            kept = excess_of(lumen, family, r * u, r * v, True, scratch) <= 0.0
            if inside and not kept:
                low, high, inside = r - family.farthest / steps, r, False
                while high - low > 1e-6 * family.farthest:
                    middle = 0.5 * (low + high)
                    if excess_of(lumen, family, middle * u, middle * v, True, scratch) <= 0.0:
                        low = middle
                    else:
                        high = middle
                exits[i] = low
                cost = cost_of(lumen, family, low * u, low * v, scratch)
                if cost < best:
                    best_a, best_b, best, at = low * u, low * v, cost, places[i]
            if kept:
                cost = cost_of(lumen, family, r * u, r * v, scratch)
                if cost < least:
                    any_a, any_b, least = r * u, r * v, cost
                if inside and cost < best:
                    best_a, best_b, best, at = r * u, r * v, cost, places[i]
    return best_a, best_b, best, any_a, any_b, min(least, best), at
