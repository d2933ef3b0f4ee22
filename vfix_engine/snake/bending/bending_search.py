"""The search for the bend of least cost within the bounds, compiled: Kwok 2013, eq. 14-20, section IV.B.

The cost function depends only on the bend and is cheap; evaluations of the query are limited. A bend has
to be reachable from rest along its ray of (a, b), so a ray is usable up to where it first leaves the pathway.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...kernels.compiled import compiled, no_refcount
from .bending_kernel import BendWorkspace, DistalPathway, Family, cost_of, excess_of

# Search state: cost, radius and t of the best bend, and of the last one whose path was checked; evaluations; t
# between which directions are tried; radii at which paths were narrow
RECORD, BEST, AT, SAFE, MADE, LEAST, MOST, NARROW = 0, 1, 2, 3, 6, 7, 8, 9
_NARROWS = 3
STATE = NARROW + _NARROWS

# Directions tried first, t of ``direction``; not sorted, so that few of them improve the best one.
_LOOKS = (
    3.5, -3.5, 0.0, 4.5, 2.5, -2.5, -4.5, 5.5, 1.5, -1.5, -5.5, 6.5, 0.75, -0.75, -6.5, 7.5, -7.5,
    0.25, -0.25, 1.0, -1.0, 2.0, -2.0, 8.5, -8.5, 3.0, -3.0, 4.0, -4.0, 9.5, -9.5, 5.0, -5.0, 6.0, -6.0,
)  # fmt: skip
_FIRST_LOOK = 17  # of them; the others if evaluations are left
UTMOST = 10.0  # |t| at most
_STEPS = 24  # steps along a ray at which its cost is evaluated
_HALVINGS = 7  # of such a step
_EXITS = 14  # evaluations at most for the exit of a ray from the pathway
_STRIDE, _STRIDE_LEAST = 1.3, 0.025  # step to the next possible exit: of the radius, of the farthest
_DEEP = 20.0  # [mm] upper limit of an excess, which is not informative far outside
_GLANCES = 2  # samples of the path to a bend in a direction tried first
_DIRECTION = 6  # evaluations at most to find that a direction improves the best bend
_CHECKS = 7  # samples of the path to the result, checked at the end
_REPAIR = 4  # further ones, if one of them is beyond the bounds
_COARSE, _FINE = 1e-2, 2e-4  # least improvement and accuracy, of z_max
_CLOSER, _CLOSEST = 1.0 / 16.0, 1.0 / 128.0  # of t: at which the path is checked, and the finest resolution


@no_refcount
def direction(family: Family, t: float) -> float:
    """The angle of a ray in the plane of (a, b): the middle at t = 0; each 1 of t halves the distance to the edge.

    The reachable region is long and narrow: an S-shaped bend, which leaves the tip in the middle, can be large, and it
    is near the edge of the half plane in which the tip moves in the desired direction.
    """
    half = 0.5 * (family.high - family.low)
    away: float = half * (1.0 - 2.0 ** -abs(t))
    middle: float = family.low + half
    return middle + away if t > 0.0 else middle - away


@no_refcount
def along(
    lumen: DistalPathway, family: Family, phi: float, target: float, scratch: BendWorkspace
) -> tuple[float, float]:
    """Radii at which a ray's cost first falls to ``target`` and of its minimum beyond; negative if it does not."""
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
    """Radius up to which a ray keeps the bounds, from ``low``, which keeps them by −g_low, to ``high``; evaluations.

    In growing steps up to the first radius beyond them, as larger ones may be within them again; then by
    false position on the excess (Illinois), which is known on both sides of the bound, until the rest is
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
    """Measure the path to a bend at samples: the radius up to which it is within the bounds, usually r; evaluations.

    Where it is not, its end is refined by further samples. Between the two results, the radius of the deepest sample:
    -1 where none is deep.
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
    """Whether a direction improves the best bend by ``demand``; it becomes the best one then, as far as it is usable.

    It is tested first at the radius where its cost falls so low, then at the radii where paths were narrow,
    then at a few samples of its path.
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
    """Check whether all of the path to the best bend is within the bounds.

    If not, the best bend becomes the part before, or the last one whose path was checked, whichever is better; in the
    latter case directions nearer to the refused one are not tried any more. The deepest radius of the path is stored,
    as neighbouring paths are usually narrow at the same radius.
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
    """Try directions ever closer to the best, until they differ by ``finest`` in t: whether one improves it."""
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

    Directions are tried over the whole range, then ever closer to the best; if evaluations are left, the same with
    others between them. Each takes one evaluation as long as it does not improve the best. The path to the best is
    checked now and then; if it leaves the bounds, the search continues from the best that does not. The rest shape has
    to be within the bounds.
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
    """Every direction ``places`` (n,), t of ``direction``, evaluated at ``steps`` radii along its ray.

    a, b and cost of the best bend before its ray's first exit, then of the best that may be beyond one, then t of the
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
