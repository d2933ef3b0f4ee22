"""How far the tool can be from a robot's axes: the lever in the bound of a swept motion's second derivative.

Along a joint motion q(t) = q₀ + t Δq a point p of the tool has the second derivative

    p'' = Σᵢⱼ Δqᵢ Δqⱼ zᵢ × (zⱼ × (p − oⱼ))   (i ≤ j, both revolute)  +  2 Σ Δqᵢ Δqⱼ zᵢ × zⱼ   (j prismatic beyond i),

and ‖zⱼ × (p − oⱼ)‖ is p's distance to axis j.
So ‖p''‖ ≤ (Σ|Δq revolute|)² L + 2 Σ|Δq revolute| Σ|Δq prismatic|, with L any bound of those distances.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ROUNDING = 1.0 + 1e-9  # what the arithmetic of the bound itself may be off by


class _Joint(Protocol):
    @property
    def kind(self) -> str: ...
    @property
    def axis(self) -> tuple[float, float, float]: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...
    @property
    def placement(self) -> Array: ...


def levers(joints: Sequence[_Joint], points: Array) -> Array:
    """Upper bounds (n,) in mm of the distance from each revolute axis to any of the points, 0 for prismatic joints.

    They hold for every configuration in the joints' ranges, and for every point between two of the points as well,
    since the distance to a line is convex.
    Each point is followed from the tool to the base as a ball that contains all the places where it can be (an arc is
    wrapped in the smallest ball around it, a slide in the ball over its length), and as a distance from the joint's
    origin that it cannot exceed; the smaller of the two bounds counts.

    Args:
        joints: from the base outwards; points: (k, 3) in the last joint's moving frame, mm.
    """
    bounds = np.zeros(len(joints))
    for point in np.asarray(points, dtype=float):
        centre, radius, far = point, 0.0, float(np.linalg.norm(point))
        for index in reversed(range(len(joints))):
            joint = joints[index]
            axis = np.array(joint.axis)
            if joint.kind == "prismatic":
                centre = centre + 0.5 * (joint.lower + joint.upper) * axis
                radius += 0.5 * (joint.upper - joint.lower)
                far += max(abs(joint.lower), abs(joint.upper))
            else:
                foot = float(centre @ axis) * axis
                arm = float(np.linalg.norm(centre - foot))
                bounds[index] = max(bounds[index], _ROUNDING * min(arm + radius, far))
                centre, grown = _around_arc(centre - foot, axis, joint.lower, joint.upper)
                centre, radius = foot + centre, radius + grown
            far = min(far, float(np.linalg.norm(centre)) + radius)
            centre = joint.placement[:3, :3] @ centre + joint.placement[:3, 3]
            far += float(np.linalg.norm(joint.placement[:3, 3]))
    return bounds


def _around_arc(arm: Array, axis: Array, lower: float, upper: float) -> tuple[Array, float]:
    """Centre (3,) and radius of the smallest ball around the arc of ``arm`` (3,), at right angles to the axis."""
    half = 0.5 * (upper - lower)
    length = float(np.linalg.norm(arm))
    if half >= 0.5 * math.pi:
        return np.zeros(3), length
    middle = 0.5 * (lower + upper)
    towards = math.cos(middle) * arm + math.sin(middle) * np.cross(axis, arm)
    return math.cos(half) * towards, math.sin(half) * length
