"""Closest points between a segment and an axis-aligned box, compiled."""

from __future__ import annotations

from ...arrays import Array
from ...kernels.compiled import compiled


@compiled
def _half_derivative(t: float, p: Array, d: Array, box: Array) -> float:
    """Half the derivative of the squared distance from p + t·d to the box."""
    total = 0.0
    for i in range(3):
        x = p[i] + t * d[i]
        total += d[i] * (min(x - box[0, i], 0.0) + max(x - box[1, i], 0.0))
    return total


@compiled
def segment_box(p: Array, d: Array, box: Array) -> tuple[float, float]:
    """Closest point of the segment p + t·d, t in [0, 1], to a box (2, 3): (squared distance, t).

    The squared distance is convex in t and quadratic between the at most six values where the segment crosses a plane
    of the box: bisection over these leaves one piece, whose minimum is exact.
    """
    low, high = 0.0, 1.0
    at_low, at_high = _half_derivative(0.0, p, d, box), _half_derivative(1.0, p, d, box)
    if at_low >= 0.0:
        t = 0.0
    elif at_high <= 0.0:
        t = 1.0
    else:
        for i in range(3):
            if d[i] != 0.0:
                for side in range(2):
                    cut = (box[side, i] - p[i]) / d[i]
                    if low < cut < high:
                        slope = _half_derivative(cut, p, d, box)
                        if slope <= 0.0:
                            low, at_low = cut, slope
                        else:
                            high, at_high = cut, slope
        t = low - at_low * (high - low) / (at_high - at_low)
    gap = 0.0
    for i in range(3):
        x = p[i] + t * d[i]
        off = min(x - box[0, i], 0.0) + max(x - box[1, i], 0.0)
        gap += off * off
    return gap, t
