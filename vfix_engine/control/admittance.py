"""Admittance law: from the force of the user's hand to the desired velocity of the tip (Li 2007, eq. 9-11).

With D = [t 0 0] the operators of (9) are span [D] = t tᵀ and kernel ⟨D⟩ = I − [D], with t the unit tangent.
Vectors are triples of floats (``geometry.triples``); the functions are inlined into the compiled requests of the tasks.
"""

from __future__ import annotations

import math

from ..kernels.compiled import shared
from ..kernels.triples import Triple, dot, minus, norm, over, plus, times


@shared
def saturate(vector: Triple, cap: float) -> Triple:
    """Scale the vector down to length ``cap`` if it is longer."""
    size = norm(vector)
    if size <= cap:
        return vector[0], vector[1], vector[2]
    return times(cap / size, vector)


@shared
def path_velocity(
    force: Triple, tangent: Triple, offset: Triple, gain: float, k_d: float, k_tau: float, capture: float
) -> Triple:
    """Compute the desired tip velocity in mm/s that follows a path and corrects deviations from it.

    Args:
        force: force of the hand in N.
        tangent: unit tangent t of the path at the point closest to the tip.
        offset: vector u from the tip to that point in mm.
        gain: admittance k in mm/s/N; k_d: blend factor of (11); k_tau: compliance across the preferred direction (10).
        capture: offset in mm at which the correction saturates. In the printed law u has units of length, so a distant
            tip is only corrected and a near one hardly at all; u / capture, limited to length 1, keeps k_d a blend.

    The printed law loses the sign of D_c: a hand that pushes away from the path would move the tool away.
    Here only the component of the force along d_c counts, so such a force causes no motion (docs/concepts.md).
    """
    along = times(dot(tangent, force), tangent)
    across = minus(offset, times(dot(tangent, offset), tangent))
    strength = norm(force)
    correction = times(k_d * strength, saturate(over(across, capture), 1.0))
    preferred = plus(times(1.0 - k_d, along), correction)  # eq. 11
    size = norm(preferred)
    if size < 1e-12 * max(strength, 1e-300) or strength == 0.0:
        return times(k_tau * gain, minus(force, along))
    direction = over(preferred, size)
    share = dot(direction, force)
    yielding = times(gain * k_tau, minus(force, times(share, direction)))
    return plus(times(gain * max(share, 0.0), direction), yielding)  # eq. 10


@shared
def approach_velocity(force: Triple, towards: Triple, gain: float, fastest: float = math.inf) -> Triple:
    """Compute the velocity that moves a point straight to its goal while the hand applies a force.

    The speed is ``gain`` × force, the direction is that to the goal: without force there is no motion.

    Args:
        towards: vector from the point to its goal in mm.
        fastest: largest speed in mm/s from which the point can still stop at the goal.
    """
    distance = norm(towards)
    if distance == 0.0:
        return 0.0, 0.0, 0.0
    return times(min(gain * norm(force), fastest) / distance, towards)


@shared
def slew_limited(now: Triple, wanted: Triple, change: float) -> tuple[Triple, float]:
    """Limit the change of velocity in one step; return the new velocity and the fraction s of the change.

    A tool has inertia: v = v_now + s (v_wanted − v_now) with ‖v − v_now‖ ≤ change, an acceleration × dt.
    Without a hand v_wanted is 0, and the same equation decelerates the tool along its fixture.
    """
    difference = minus(wanted, now)
    size = norm(difference)
    if size <= change:
        return wanted, 1.0
    return plus(now, times(change / size, difference)), change / size
