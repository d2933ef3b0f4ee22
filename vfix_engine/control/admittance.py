"""The admittance law: from the hand's force to the tip's desired velocity (Li 2007, eq. 9-11).

With D = [t 0 0] the operators of (9) are span [D] = t tᵀ and kernel ⟨D⟩ = I − [D], t the unit tangent.
Vectors are three numbers each (``geometry.triples``); the functions are part of the compiled requests of the tasks.
"""

from __future__ import annotations

import math

from ..kernels.compiled import shared
from ..kernels.triples import Triple, dot, minus, norm, over, plus, times


@shared
def saturate(vector: Triple, cap: float) -> Triple:
    """The vector, shortened to length ``cap`` where it is longer."""
    size = norm(vector)
    if size <= cap:
        return vector[0], vector[1], vector[2]
    return times(cap / size, vector)


@shared
def path_velocity(
    force: Triple, tangent: Triple, offset: Triple, gain: float, k_d: float, k_tau: float, capture: float
) -> Triple:
    """Desired tip velocity in mm/s that follows a path and comes back to it.

    Args:
        force: the hand's force in N.
        tangent: unit tangent t of the path at the closest point.
        offset: u, from the tip to the closest point of the path in mm.
        gain: k in mm/s/N; k_d: blend of (11); k_tau: compliance across the preferred direction of (10).
        capture: offset in mm from which on the correction is full. As printed u is a length, so that a far-off tip
            is all correction and a near one hardly any; u / capture, cut at length 1, keeps k_d a blend.

    The printed law loses the sign of D_c: a hand that pushes outwards would move the tool away from the path.
    Here only the part of the force along d_c counts, so such a hand moves nothing (docs/concepts.md).
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
    """Velocity that brings a point straight to its goal while a hand is on the grip.

    The speed is the hand's, ``gain`` × its force; the direction is the guide's: no force, no motion.

    Args:
        towards: from the point to its goal in mm.
        fastest: speed in mm/s from which it can still stop at the goal.
    """
    distance = norm(towards)
    if distance == 0.0:
        return 0.0, 0.0, 0.0
    return times(min(gain * norm(force), fastest) / distance, towards)


@shared
def slew_limited(now: Triple, wanted: Triple, change: float) -> tuple[Triple, float]:
    """The velocity one step nearer to the wanted one, and the share s of the change from one to the other.

    A tool has inertia: v = v_now + s (v_wanted − v_now), so that ‖v − v_now‖ ≤ change, an acceleration × dt.
    A hand that is gone wants 0: the same line brings the tool to rest, along its fixture.
    """
    difference = minus(wanted, now)
    size = norm(difference)
    if size <= change:
        return wanted, 1.0
    return plus(now, times(change / size, difference)), change / size
