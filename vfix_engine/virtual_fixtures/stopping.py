"""Stopping distance in discrete time: the longest step after which a motion can still stop in time.

Notation: w is the length of a step, in mm or rad; e = a·dt² is the largest change of w from one step to the next.

A sequence of steps w, w − e, w − 2e, … that ends when the next one would not be positive covers the distance

    D(w) = w + (w − e) + (w − 2e) + …

D is piecewise linear, convex and increasing; with n = ⌊w / e⌋ it is (n + 1) w − e n (n + 1) / 2.
The formula of continuous time, v² / 2a, is too short by up to v·dt / 2 and overshoots.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled, no_refcount

_ROUNDED_UP = 1.0 + 1e-12  # factor larger than rounding errors


@no_refcount
def stoppable_step(slack: float, change: float) -> float:
    """The longest step w with D(w) ≤ slack, so that the steps after it can stop within the slack.

    Exact up to rounding: D is the maximum of the lines of its pieces, and a square root gives the piece of ``slack``.
    After a step w ≤ stoppable_step(R, e) the next step may be w − e, because D(w − e) = D(w) − w ≤ R − w, the
    remaining slack; and so on until a step is not longer than e.

    Args:
        slack: distance to the limit, in mm or rad; 0 or a negative slack allows no step: 0.
        change: e = acceleration · dt²; ∞: the motion can stop within one step.
    """
    if not slack > 0.0:
        return 0.0
    n = math.floor(0.5 * (math.sqrt(1.0 + 8.0 * slack / change) - 1.0))
    if n <= 0.0:
        return slack
    return (slack + 0.5 * change * n * (n + 1.0)) / (n + 1.0)


@no_refcount
def stoppable_up_to(longest: float, slack: float, change: float) -> float:
    """min(longest, stoppable_step(slack, change)), without the square root if ``longest`` is the smaller one.

    D(w) ≤ (w + e/2)² / 2e, so a slack above that bound lets ``longest`` stop.
    """
    least = longest + 0.5 * change
    if 2.0 * change * slack > least * least * _ROUNDED_UP:
        return longest
    return min(longest, stoppable_step(slack, change))


@no_refcount
def stopping_distance(step: float, change: float) -> float:
    """D(w): the distance to rest, a step w ≥ 0 included.

    Args:
        step: w in mm or rad; change: e as in :func:`stoppable_step`.
    """
    if not change < math.inf:
        return step
    n = math.floor(step / change)
    return (n + 1.0) * step - 0.5 * change * n * (n + 1.0)


@compiled
def stoppable_steps(slacks: Array, change: float) -> Array:
    """:func:`stoppable_step` of every slack (m,)."""
    steps = np.empty(len(slacks))
    for i in range(len(slacks)):
        steps[i] = stoppable_step(slacks[i], change)
    return steps


@compiled
def approach_bounds(slacks: Array, change: float) -> Array:
    """:func:`approach_bound` of every slack (m,)."""
    bounds = np.empty(len(slacks))
    for i in range(len(slacks)):
        bounds[i] = approach_bound(slacks[i], change)
    return bounds


@no_refcount
def approach_bound(slack: float, change: float) -> float:
    """Return the bound, in mm, of a boundary row −n·ΔP_k ≤ bound (Li 2007, eq. 16, uses ``slack`` itself).

    Outside the margin it is the longest approach from which the point can still stop before the margin: about
    √(2 · change · slack) at a distance, and all of the slack in the last step.
    Inside the margin it is negative: the point must retreat, by at most ``change``, which a robot can achieve from rest
    in one step. So the row by itself never makes a program infeasible.

    Args:
        slack: distance to the margin in mm; negative inside it.
        change: deceleration · dt² in mm.
    """
    return stoppable_step(slack, change) if slack >= 0.0 else max(slack, -change)
