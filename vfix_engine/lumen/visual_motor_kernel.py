"""From motions in the camera's picture to motions on the surface of bends, compiled: Kwok 2013, eq. 24-28.

Everything is in the frame {l} that the distal links hang on: the picture moves with the robot, wherever that is.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, compiled
from ..robots.snake_kernel import snake_frames, snake_jacobian
from .hermite_kernel import hermite_cartesian

Array = NDArray[np.float64]

_ROUNDS = 6  # corrections of one step; one or two are needed away from singular places
_CLOSE = 1e-6  # of the wanted motion: close enough
_WEAK = 5.0  # [mm] per unit of r: a direction in which the camera moves less is damped
_STRIDE = 0.25  # of r at most in one correction, as far as the slopes are worth anything


@borrowing
def look(q: Array, length: float, ahead: float, base: Array, frames: Array, jacobian: Array) -> None:
    """The links' frames (L, 3, 4) in {l} and ∂x_C/∂q (3, 2L) in {l}, mm/rad, of the camera (24)-(25)."""
    snake_frames(q, base, length, frames)
    last = len(frames) - 1
    x = frames[last, 0, 3] + ahead * frames[last, 0, 2]
    y = frames[last, 1, 3] + ahead * frames[last, 1, 2]
    z = frames[last, 2, 3] + ahead * frames[last, 2, 2]
    snake_jacobian(frames, base, q, last, x, y, z, jacobian)


@compiled
def camera_rows(q: Array, length: float, ahead: float) -> Array:
    """The first two rows of ∂x_C/∂q in the camera's own frame (2, 2L), mm/rad (26)."""
    joints = len(q)
    frames, jacobian, rows = np.empty((joints // 2, 3, 4)), np.empty((3, joints)), np.empty((2, joints))
    look(q, length, ahead, np.eye(4), frames, jacobian)
    tip = frames[joints // 2 - 1]
    for k in range(joints):
        for row in range(2):
            rows[row, k] = tip[0, row] * jacobian[0, k] + tip[1, row] * jacobian[1, k] + tip[2, row] * jacobian[2, k]
    return rows


@compiled
def steer(
    knots: Array,
    coefficients: Array,
    rest: Array,
    q_max: float,
    length: float,
    ahead: float,
    r_max: float,
    u: float,
    v: float,
    right: float,
    down: float,
) -> tuple[float, float]:
    """(u, v) at which the camera has moved by (right, down) mm in the picture it had at the start, as near as can be.

    Newton's steps with the Jacobian of (28) in (u, v), damped where it is nearly singular; the best place on the way.
    """
    joints = len(rest)
    base, frames, jacobian = np.eye(4), np.empty((joints // 2, 3, 4)), np.empty((3, joints))
    surface, q, start = np.empty((3, joints)), np.empty(joints), np.empty((3, 4))
    least, best_u, best_v = math.inf, u, v
    wanted = math.sqrt(right * right + down * down)
    last = joints // 2 - 1
    for turn in range(_ROUNDS + 1):
        hermite_cartesian(knots, coefficients, rest, u, v, surface)
        for k in range(joints):
            q[k] = min(max(surface[0, k], -q_max), q_max)
        look(q, length, ahead, base, frames, jacobian)
        tip = frames[last]
        if turn == 0:
            for i in range(3):
                start[i, 0], start[i, 1] = tip[i, 0], tip[i, 1]
                start[i, 3] = tip[i, 3] + ahead * tip[i, 2]
        x, y = right, down
        for i in range(3):
            moved = tip[i, 3] + ahead * tip[i, 2] - start[i, 3]
            x, y = x - moved * start[i, 0], y - moved * start[i, 1]
        missing = math.sqrt(x * x + y * y)
        if not missing < least:
            break
        least, best_u, best_v = missing, u, v
        if missing <= _CLOSE * wanted:
            break
        xu, xv, yu, yv = 0.0, 0.0, 0.0, 0.0
        for k in range(joints):
            if abs(surface[0, k]) <= q_max:  # a joint at its limit stays there
                a = start[0, 0] * jacobian[0, k] + start[1, 0] * jacobian[1, k] + start[2, 0] * jacobian[2, k]
                b = start[0, 1] * jacobian[0, k] + start[1, 1] * jacobian[1, k] + start[2, 1] * jacobian[2, k]
                xu, xv = xu + a * surface[1, k], xv + a * surface[2, k]
                yu, yv = yu + b * surface[1, k], yv + b * surface[2, k]
        du, dv = damped(xu, xv, yu, yv, x, y)
        stride = math.sqrt(du * du + dv * dv)
        scale = _STRIDE / stride if stride > _STRIDE else 1.0
        u, v = u + scale * du, v + scale * dv
        r = math.sqrt(u * u + v * v)
        if r > r_max:
            u, v = u * r_max / r, v * r_max / r
    return best_u, best_v


@borrowing
def damped(a: float, b: float, c: float, d: float, x: float, y: float) -> tuple[float, float]:
    """(JᵀJ + λ²)⁻¹ Jᵀ (x, y) of J = [[a, b], [c, d]]; λ is 0 unless its least singular value is below _WEAK.

    Nakamura & Hanafusa 1986, "Inverse kinematic solutions with singularity robustness for robot manipulator control".
    """
    aa, ab, bb = a * a + c * c, a * b + c * d, b * b + d * d
    half = 0.5 * (aa + bb)
    weakest = half - math.sqrt(0.25 * (aa - bb) * (aa - bb) + ab * ab)  # its square
    damping = max(_WEAK * _WEAK - max(weakest, 0.0), 0.0)
    aa, bb = aa + damping, bb + damping
    size = aa * bb - ab * ab
    p, s = a * x + c * y, b * x + d * y
    return (bb * p - ab * s) / size, (aa * s - ab * p) / size
