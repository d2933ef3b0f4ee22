"""The curve that a driven snake conforms to, and the shapes between two conforming ones."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...geometry.curve import Curve
from ...kernels.compiled import compiled
from ...pathway.pathway import Pathway
from .conformance import ShapeSolution


def driven_curve(pathway: Pathway, curve: Curve | None) -> Curve:
    """What a snake conforms to at first: a pathway that moves takes its own centres along, and no other curve."""
    return curve if curve is not None and pathway.motion is None else pathway.curve(0.0)


def blended(one: ShapeSolution, two: ShapeSolution, share: float) -> ShapeSolution:
    """Between one conforming shape and another; the second, bit by bit, at 1."""
    if share >= 1.0:
        return two
    base = np.empty((4, 4))
    _blend_base(one.base, two.base, share, base)
    q = one.q + share * (two.q - one.q)
    joint_s = one.joint_s + share * (two.joint_s - one.joint_s)
    offset_mm = one.offset_mm + share * (two.offset_mm - one.offset_mm)
    tip_s = min(one.tip_s + share * (two.tip_s - one.tip_s), two.curve.length)
    return ShapeSolution(base, q, joint_s, offset_mm, two.at_limit, False, tip_s, two.roll, two.curve)


@compiled
def _blend_base(base: Array, end: Array, share: float, out: Array) -> None:
    """A base (4, 4) between two: its origin in a straight line, its axes by one turn about a fixed axis (Rodrigues).

    Bases that are half a turn apart have no such axis; conforming shapes never are.
    """
    x = y = z = trace = 0.0
    for c in range(3):
        x += 0.5 * (end[2, c] * base[1, c] - end[1, c] * base[2, c])
        y += 0.5 * (end[0, c] * base[2, c] - end[2, c] * base[0, c])
        z += 0.5 * (end[1, c] * base[0, c] - end[0, c] * base[1, c])
        trace += end[0, c] * base[0, c] + end[1, c] * base[1, c] + end[2, c] * base[2, c]
    size = math.sqrt(x * x + y * y + z * z)  # sine of the turn
    angle = share * math.atan2(size, 0.5 * (trace - 1.0))
    if size > 0.0:
        x, y, z = x / size, y / size, z / size
    sine, rest = math.sin(angle), 1.0 - math.cos(angle)
    for c in range(3):
        a, b, d = base[0, c], base[1, c], base[2, c]
        along = rest * (x * a + y * b + z * d)
        out[0, c] = a + sine * (y * d - z * b) - rest * a + along * x
        out[1, c] = b + sine * (z * a - x * d) - rest * b + along * y
        out[2, c] = d + sine * (x * b - y * a) - rest * d + along * z
        out[c, 3] = base[c, 3] + share * (end[c, 3] - base[c, 3])
        out[3, c] = 0.0
    out[3, 3] = 1.0
