"""The admittance law: from the hand's force to the tip's desired velocity (Li 2007, eq. 9-11).

With D = [t 0 0] the operators of (9) are span [D] = t tᵀ and kernel ⟨D⟩ = I − [D], t the unit tangent.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.vectors import length

Array = NDArray[np.float64]


def saturate(vector: Array, cap: float) -> Array:
    """The vector, shortened to length ``cap`` where it is longer."""
    size = length(vector)
    return vector if size <= cap else vector * (cap / size)


def path_velocity(
    force: Array, tangent: Array, offset: Array, *, gain: float, k_d: float, k_tau: float, capture: float
) -> Array:
    """Desired tip velocity (3,) in mm/s that follows a path and comes back to it.

    Args:
        force: the hand's force (3,) in N.
        tangent: unit tangent t of the path at the closest point (3,).
        offset: u, from the tip to the closest point of the path (3,) in mm.
        gain: k in mm/s/N; k_d: blend of (11); k_tau: compliance across the preferred direction of (10).
        capture: offset in mm from which on the correction is full. As printed u is a length, so that a far-off tip
            is all correction and a near one hardly any; u / capture, cut at length 1, keeps k_d a blend.

    The printed law loses the sign of D_c: a hand that pushes outwards would move the tool away from the path.
    Here only the part of the force along d_c counts, so such a hand moves nothing (docs/concepts.md).
    """
    along = tangent * (tangent @ force)
    across = offset - tangent * (tangent @ offset)
    strength = length(force)
    preferred = (1.0 - k_d) * along + k_d * strength * saturate(across / capture, 1.0)  # eq. 11
    size = length(preferred)
    if size < 1e-12 * max(strength, 1e-300) or strength == 0.0:
        return k_tau * gain * (force - along)
    direction = preferred / size
    share = float(direction @ force)
    velocity: Array = gain * max(share, 0.0) * direction + gain * k_tau * (force - share * direction)  # eq. 10
    return velocity


def approach_velocity(force: Array, towards: Array, *, gain: float, fastest: float = np.inf) -> Array:
    """Velocity (3,) that brings a point straight to its goal while a hand is on the grip.

    The speed is the hand's, ``gain`` × its force; the direction is the guide's: no force, no motion.

    Args:
        towards: from the point to its goal (3,) in mm.
        fastest: speed in mm/s from which it can still stop at the goal.
    """
    distance = length(towards)
    if distance == 0.0:
        return np.zeros(3)
    return towards * (min(gain * length(force), fastest) / distance)


def slew_limited(now: Array, wanted: Array, change: float) -> tuple[Array, float]:
    """The velocity one step nearer to the wanted one, and the share s of the change from one to the other.

    A tool has inertia: v = v_now + s (v_wanted − v_now), so that ‖v − v_now‖ ≤ change, an acceleration × dt.
    A hand that is gone wants 0: the same line brings the tool to rest, along its fixture.
    """
    difference = wanted - now
    size = length(difference)
    if size <= change:
        return wanted, 1.0
    return now + difference * (change / size), change / size
