"""Orientation of a shaft between stations along a path, compiled.

A frame is a rotation (3, 3) whose y axis points along the shaft towards the tip. Between two stations the y axis
follows a great circle; the frame is parallel transported with it and rotated about y by ``twist`` rad in proportion to
the arc length.
"""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from ..kernels.compiled import compiled, shared
from ..kernels.triples import Triple, cross, dot, norm, over, plus, times

_OPPOSITE = 1e-12  # sine of the angle below which two axes do not define a great circle


@shared
def turned(vector: Triple, axis: Triple, angle: float) -> Triple:
    """Rotate a vector about a unit axis by ``angle`` rad (Rodrigues' formula)."""
    c, s = math.cos(angle), math.sin(angle)
    along = times((1.0 - c) * dot(axis, vector), axis)
    return plus(plus(times(c, vector), times(s, cross(axis, vector))), along)


@shared
def column(frame: Array, number: int) -> Triple:
    """A column of a matrix (3, 3)."""
    return frame[0, number], frame[1, number], frame[2, number]


@shared
def turn_between(first: Triple, second: Triple, across: Triple) -> tuple[Triple, float]:
    """Unit axis and angle in rad of the smallest rotation from one unit vector to another.

    across: unit vector perpendicular to ``first``, used as the axis if the two are opposite.
    """
    normal = cross(first, second)
    sine, cosine = norm(normal), dot(first, second)
    if sine > _OPPOSITE:
        return over(normal, sine), math.atan2(sine, cosine)
    return across, 0.0 if cosine > 0.0 else math.pi


@shared
def axes_at(stations: Array, frames: Array, twists: Array, s: float) -> tuple[Triple, Triple]:
    """The y and z axes of the frame at arc length s; constant before the first and after the last station.

    Args:
        stations: (m,) increasing, in mm; frames: (m, 3, 3); twists: (m − 1,) in rad, from each frame to the next.
    """
    last = len(stations) - 1
    k = 0
    while k < last - 1 and stations[k + 1] <= s:
        k += 1
    y, z = column(frames[k], 1), column(frames[k], 2)
    if last == 0 or s <= stations[0]:
        return y, z
    share = min((s - stations[k]) / (stations[k + 1] - stations[k]), 1.0)
    axis, angle = turn_between(y, column(frames[k + 1], 1), z)
    z = turned(z, y, share * twists[k])
    return turned(y, axis, share * angle), turned(z, axis, share * angle)


@compiled
def frames_at(stations: Array, frames: Array, twists: Array, places: Array) -> Array:
    """Frames (n, 3, 3) at arc lengths (n,)."""
    out = np.empty((len(places), 3, 3))
    for i in range(len(places)):
        y, z = axes_at(stations, frames, twists, places[i])
        x = cross(y, z)
        for j in range(3):
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = x[j], y[j], z[j]
    return out
