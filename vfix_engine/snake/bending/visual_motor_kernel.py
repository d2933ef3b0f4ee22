"""From motions in the camera's picture to motions on the surface of bends, compiled: Kwok 2013, eq. 24-28.

Everything is in the frame {l} of the distal links: the picture moves with the robot.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...kernels.compiled import compiled, no_refcount
from ...robots.snake_kernel import snake_frames, snake_jacobian
from .hermite_kernel import hermite_cartesian

_ROUNDS = 6  # corrections of one step; one or two are needed away from singular points
_HALVINGS = 7  # halvings of a correction that comes no nearer
_KINK = 0.1  # of the desired motion: with a larger rest, rays are tested
_RAYS = 32
_SHORT = 1e-3  # [r] length of a ray over which its slope is measured first
_SECANTS = 3  # points of a ray that are tried
_CLOSE = 1e-6  # of the desired motion: tolerance
_WEAK = 5.0  # [mm] per unit of r: a direction in which the camera moves less is damped
_STRIDE = 0.25  # of r at most in one correction, within which the slopes are valid


class BendSurface(NamedTuple):
    """Bends and the links that they bend: ``PolarHermite``'s knots, coefficients and rest, and the snake's lengths."""

    knots: Array
    coefficients: Array
    rest: Array
    q_max: float
    length: float
    ahead: float
    r_max: float


class MapWorkspace(NamedTuple):
    """Memory: Q and its slopes (3, 2L), joints (2L,), a base (4, 4), frames (L, 3, 4) and ∂x_C/∂q (3, 2L).

    base: the identity. start: (3, 4) the initial camera pose in {l}, its position in the last column.
    """

    slopes: Array
    q: Array
    base: Array
    frames: Array
    jacobian: Array
    start: Array


@no_refcount
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
def camera_moved(before: Array, after: Array, length: float, ahead: float) -> Array:
    """Displacement of the camera (2,) mm from joints to others (2L,), in the picture that it had before."""
    base, frames = np.eye(4), np.empty((len(before) // 2, 3, 4))
    last, seen, moved = len(frames) - 1, np.empty((3, 4)), np.zeros(2)
    snake_frames(before, base, length, frames)
    seen[:] = frames[last]
    snake_frames(after, base, length, frames)
    for k in range(3):
        shift = frames[last, k, 3] + ahead * frames[last, k, 2] - (seen[k, 3] + ahead * seen[k, 2])
        moved[0] += seen[k, 0] * shift
        moved[1] += seen[k, 1] * shift
    return moved


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
    """(u, v) at which the camera has moved by (right, down) mm in its initial picture, or as near as possible.

    Newton steps with the Jacobian of (28) in (u, v), damped where it is nearly singular and halved until they come
    nearer. Where that ends early, at a kink of the surface, rays in all directions give the point to continue from.
    """
    surface = BendSurface(knots, coefficients, rest, q_max, length, ahead, r_max)
    joints, last = len(rest), len(rest) // 2 - 1
    work = MapWorkspace(
        np.empty((3, joints)), np.empty(joints), np.eye(4), np.empty((last + 1, 3, 4)), np.empty((3, joints)),
        np.empty((3, 4)),
    )  # fmt: skip
    pose(surface, work, u, v)
    for i in range(3):
        for k in range(3):
            work.start[i, k] = work.frames[last, i, k]
        work.start[i, 3] = work.frames[last, i, 3] + ahead * work.frames[last, i, 2]
    wanted = math.sqrt(right * right + down * down)
    best_u, best_v, missing = newton(surface, work, right, down, u, v, wanted)
    if missing > _KINK * wanted:
        u, v, missing_there = by_rays(surface, work, right, down, u, v, missing)
        if missing_there < missing:
            best_u, best_v, _ = newton(surface, work, right, down, u, v, missing_there)
    return best_u, best_v


@no_refcount
def newton(
    surface: BendSurface, work: MapWorkspace, right: float, down: float, u: float, v: float, missing: float
) -> tuple[float, float, float]:
    """(u, v) and the remaining mm there, after decreasing steps from a point with ``missing`` mm."""
    wanted = math.sqrt(right * right + down * down)
    slopes, jacobian, start = work.slopes, work.jacobian, work.start
    for _ in range(_ROUNDS):
        if missing <= _CLOSE * wanted:
            break
        pose(surface, work, u, v)
        look(work.q, surface.length, surface.ahead, work.base, work.frames, jacobian)
        x, y = left_over(surface, work, right, down)
        xu, xv, yu, yv = 0.0, 0.0, 0.0, 0.0
        for k in range(len(work.q)):
            if abs(slopes[0, k]) <= surface.q_max:  # a joint at its limit stays there
                a = start[0, 0] * jacobian[0, k] + start[1, 0] * jacobian[1, k] + start[2, 0] * jacobian[2, k]
                b = start[0, 1] * jacobian[0, k] + start[1, 1] * jacobian[1, k] + start[2, 1] * jacobian[2, k]
                xu, xv = xu + a * slopes[1, k], xv + a * slopes[2, k]
                yu, yv = yu + b * slopes[1, k], yv + b * slopes[2, k]
        du, dv = damped(xu, xv, yu, yv, x, y)
        stride = math.sqrt(du * du + dv * dv)
        scale = _STRIDE / stride if stride > _STRIDE else 1.0
        nearer = False
        for _ in range(_HALVINGS):
            u_next, v_next, x, y = tried(surface, work, right, down, u + scale * du, v + scale * dv)
            found = math.sqrt(x * x + y * y)
            if found < missing:
                u, v, missing, nearer = u_next, v_next, found, True
                break
            scale *= 0.5
        if not nearer:
            break
    return u, v, missing


@no_refcount
def by_rays(
    surface: BendSurface, work: MapWorkspace, right: float, down: float, u: float, v: float, missing: float
) -> tuple[float, float, float]:
    """The best point on rays about (u, v), and the remaining mm there, where one has less than ``missing`` mm.

    At r = 0 and where a joint reaches its limit the surface has another slope in every direction. So each ray is
    measured: its length follows from the camera's motion over a short piece, and again over the result.
    """
    pose(surface, work, u, v)
    x, y = left_over(surface, work, right, down)
    best_u, best_v = u, v
    for ray in range(_RAYS):
        c, s = math.cos(2.0 * math.pi * ray / _RAYS), math.sin(2.0 * math.pi * ray / _RAYS)
        stride = _SHORT
        for _ in range(_SECANTS):
            u_next, v_next, x_next, y_next = tried(surface, work, right, down, u + stride * c, v + stride * s)
            found = math.sqrt(x_next * x_next + y_next * y_next)
            if found < missing:
                best_u, best_v, missing = u_next, v_next, found
            a, b = x - x_next, y - y_next  # the camera's displacement, whose command is (x, y)
            square, along = a * a + b * b, a * x + b * y
            if along <= 0.0:
                break
            stride = min(stride * along / square, _STRIDE)
    return best_u, best_v, missing


@no_refcount
def pose(surface: BendSurface, work: MapWorkspace, u: float, v: float) -> None:
    """Q and its slopes at (u, v), the joints within their limits, and the links' frames."""
    hermite_cartesian(surface.knots, surface.coefficients, surface.rest, u, v, work.slopes)
    for k in range(len(work.q)):
        work.q[k] = min(max(work.slopes[0, k], -surface.q_max), surface.q_max)
    snake_frames(work.q, work.base, surface.length, work.frames)


@no_refcount
def left_over(surface: BendSurface, work: MapWorkspace, right: float, down: float) -> tuple[float, float]:
    """The remaining motion of the camera of (right, down) in mm, in its initial picture."""
    tip, x, y = work.frames[len(work.frames) - 1], right, down
    for i in range(3):
        moved = tip[i, 3] + surface.ahead * tip[i, 2] - work.start[i, 3]
        x, y = x - moved * work.start[i, 0], y - moved * work.start[i, 1]
    return x, y


@no_refcount
def tried(
    surface: BendSurface, work: MapWorkspace, right: float, down: float, u: float, v: float
) -> tuple[float, float, float, float]:
    """The point (u, v), or the one at r_max in its direction, and the remaining motion there."""
    r = math.sqrt(u * u + v * v)
    if r > surface.r_max:
        u, v = u * surface.r_max / r, v * surface.r_max / r
    pose(surface, work, u, v)
    x, y = left_over(surface, work, right, down)
    return u, v, x, y


@no_refcount
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
