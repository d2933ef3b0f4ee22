"""Where the joints of a chain lie whose every joint centre is on a curve, and the angles that takes; compiled.

A curve is given by its samples: points (N, 3) mm every ``step`` mm, straight beyond its ends along its end tangents.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...kernels.compiled import compiled, no_refcount
from ...robots.snake_kernel import aim


@no_refcount
def on_curve(points: Array, tangents: Array, step: float, s: float, out: Array) -> None:
    """The point (3,) at arc length s."""
    last = len(points) - 1
    if s < 0.0 or s > last * step:
        end, beyond = (0, s) if s < 0.0 else (last, s - last * step)
        for k in range(3):
            out[k] = points[end, k] + beyond * tangents[end, k]
        return
    before = min(int(s / step), last - 1)
    share = s / step - before
    for k in range(3):
        out[k] = (1.0 - share) * points[before, k] + share * points[before + 1, k]


@no_refcount
def chord_behind(points: Array, tangents: Array, step: float, s: float, chord: float, joint: Array) -> float:
    """The largest s' < s whose point lies ``chord`` mm from ``joint`` (3,), the point at s.

    The samples are walked backwards to the first that is far enough; on the straight piece before it the distance is
    a quadratic with one crossing, in closed form.
    """
    if s > 0.0:
        before = min(math.ceil(s / step) - 1, len(points) - 2)
        while before >= 0:
            square = linear = rest = 0.0
            for k in range(3):
                ahead, away = points[before + 1, k] - points[before, k], points[before, k] - joint[k]
                square, linear, rest = square + ahead * ahead, linear + ahead * away, rest + away * away
            rest -= chord * chord
            if rest >= 0.0:
                share = rest / (-linear + math.sqrt(max(linear * linear - square * rest, 0.0)))
                return (before + share) * step
            before -= 1
    linear = rest = 0.0  # on the straight piece before the curve
    for k in range(3):
        away = points[0, k] - joint[k]
        linear, rest = linear + tangents[0, k] * away, rest + away * away
    rest -= chord * chord
    return -(linear + math.sqrt(max(linear * linear - rest, 0.0)))


@no_refcount
def joint_places(
    points: Array, tangents: Array, step: float, tip: float, chord: float, places: Array, joints: Array
) -> None:
    """Arc lengths (L + 1,) and points (L + 1, 3) of base joint … tip, a chord apart, the last at ``tip``."""
    link = len(places) - 1
    places[link] = tip
    on_curve(points, tangents, step, tip, joints[link])
    while link > 0:
        places[link - 1] = chord_behind(points, tangents, step, places[link], chord, joints[link])
        link -= 1
        on_curve(points, tangents, step, places[link], joints[link])


@no_refcount
def frame_on_curve(
    points: Array, tangents: Array, across: Array, step: float, s: float, roll: float, out: Array
) -> None:
    """Frame (3, 4) rows [R | p] at s: z along the curve, x the transported ``across`` (N, 3) turned by roll."""
    last = len(points) - 1
    inside = min(max(s, 0.0), last * step)
    before = min(int(inside / step), last - 1)
    share = inside / step - before
    size = 0.0
    for k in range(3):
        out[k, 2] = (1.0 - share) * tangents[before, k] + share * tangents[before + 1, k]
        out[k, 0] = (1.0 - share) * across[before, k] + share * across[before + 1, k]
        size += out[k, 2] * out[k, 2]
    along = 0.0
    for k in range(3):
        out[k, 2] /= math.sqrt(size)
        along += out[k, 2] * out[k, 0]
    size = 0.0
    for k in range(3):
        out[k, 0] -= along * out[k, 2]
        size += out[k, 0] * out[k, 0]
    for k in range(3):
        out[k, 0] /= math.sqrt(size)
    c, s_roll = math.cos(roll), math.sin(roll)
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        out[k, 1] = out[a, 2] * out[b, 0] - out[b, 2] * out[a, 0]  # y = z × x
    for k in range(3):
        x, y = out[k, 0], out[k, 1]
        out[k, 0], out[k, 1] = c * x + s_roll * y, c * y - s_roll * x
    on_curve(points, tangents, step, s, out[:, 3])


@compiled
def angles_between(joints: Array, base: Array, q: Array) -> float:
    """Angles q (2L,) that put the joint centres of a snake at ``joints`` (L + 1, 3); the largest of them.

    base: (3, 4) the frame before the first joint, its origin at joints[0].
    """
    turn = np.empty((3, 3))
    for i in range(3):
        for k in range(3):
            turn[i, k] = base[i, k]
    largest = 0.0
    for link in range(len(joints) - 1):
        wx = joints[link + 1, 0] - joints[link, 0]
        wy = joints[link + 1, 1] - joints[link, 1]
        wz = joints[link + 1, 2] - joints[link, 2]
        size = math.sqrt(wx * wx + wy * wy + wz * wz)
        x = (turn[0, 0] * wx + turn[1, 0] * wy + turn[2, 0] * wz) / size
        y = (turn[0, 1] * wx + turn[1, 1] * wy + turn[2, 1] * wz) / size
        z = (turn[0, 2] * wx + turn[1, 2] * wy + turn[2, 2] * wz) / size
        odd, even = aim(x, y, z)
        q[2 * link], q[2 * link + 1] = odd, even
        largest = max(largest, abs(odd), abs(even))
        ca, sa, cb, sb = math.cos(odd), math.sin(odd), math.cos(even), math.sin(even)
        for i in range(3):
            x, y, z = turn[i, 0], turn[i, 1], turn[i, 2]
            y, z = y * ca + z * sa, z * ca - y * sa  # Rot_x
            turn[i, 0], turn[i, 1], turn[i, 2] = x * cb - z * sb, y, x * sb + z * cb  # Rot_y
    return largest
