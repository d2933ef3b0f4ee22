"""The search for a bend from which the camera views a point of the wall, compiled.

The bends of Kwok 2013, eq. 10-19, have two parameters and are made for the position of the tip. Here all joints of the
distal links are free: damped least squares (Levenberg 1944) turn the camera's axis to the point and bring the camera to
its viewing distance, with the links' bounds (17) as penalties of an active set. Every configuration on the way keeps
the bounds by a margin, and no joint goes far from one to the next, so that the way can be certified and driven.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled, no_refcount
from ...pathway.query.query_fast import Deviations, link_deviations
from ...pathway.query.query_simd import WORK
from ...pathway.query.section import section_distance
from ...robots.snake_kernel import snake_frames
from .bending_kernel import DistalPathway

MARGIN_MM = 0.15  # [mm] inside of its bound a link stays on the way
_MOST = math.radians(3.0)  # of a joint from one configuration to the next
_DAMPING = 2e-3  # of a joint's step in rad, against an error of the view in rad
_PER_MM = 1.0 / 20.0  # [rad] of an error of the view that 1 mm of distance beyond the middle half counts as
_WALL = 2.0  # [rad] that 1 mm beyond a bound counts as
_NEAR_MM = 3.0  # links that have less left to their bound are in the active set
_ROUNDS = 3  # of the active set
_RESTORED = 6  # steps back within the bounds
_STALLED, _GAIN = 8, 0.01  # a search ends that has not gained so much in so many configurations


class ViewGoal(NamedTuple):
    """A point (3,) in mm to be viewed from a distance in mm ± tolerance, at most ``angle`` rad off the camera's axis.

    ahead: mm from the last frame to the camera.
    """

    point: Array
    distance: float
    tolerance: float
    angle: float
    ahead: float


ViewLine = tuple[float, float, float, float, float, float, float, float, float, float]
"""The camera's place in mm, its axis z, the unit vector d from it to the point, and the distance in mm."""


class SearchWorkspace(NamedTuple):
    """Memory of a search for L links: poses, axes and centres of the joints, rows and the system, and the query's."""

    frames: Array
    axes: Array
    centres: Array
    rows: Array
    slack: Array
    matrix: Array
    step: Array
    tried: Array
    depth: Array
    vertex: IntArray
    segment: IntArray
    work: Array


@compiled
def view_path(
    lumen: DistalPathway, points: Array, goal: ViewGoal, free: Array, start: Array, path: Array
) -> tuple[int, float]:
    """A way of joints from ``start`` (2L,) towards a view of the goal's point.

    Args:
        lumen: the links in their part of the pathway; its ``rest`` does not count.
        points: (V, 3) the links' vertices in their frames, of ``LinkVertices``.
        free: (2L,) 1 for joints that may move, 0 for others.
        start: within the bounds; where it exceeds one by up to its margin, it goes no deeper.
        path: (N, 2L) filled with the configurations after the start.

    Returns:
        How many there are, up to the one with the best view, and the error of that: at most 1 within the goal's
        tolerances, as ``view_error``.
    """
    joints = len(start)
    links = joints // 2
    work = SearchWorkspace(
        np.empty((links, 3, 4)), np.empty((joints, 3)), np.empty((joints, 3)), np.zeros((links, joints)),
        np.zeros(links), np.empty((joints, joints)), np.empty(joints), np.empty(joints), np.empty(links),
        np.empty(links, np.int64), np.empty(links, np.int64), np.zeros(WORK),
    )  # fmt: skip
    limit = np.empty(links)
    measured(lumen, start, work)
    for link in range(links):  # at the start a link may be within its margin
        limit[link] = max(lumen.bound[link] - MARGIN_MM, min(work.depth[link], lumen.bound[link]))
    q = start.copy()
    least, count, kept, before = view_error(work.frames, goal), 0, 0, 0
    last = least
    while count < len(path):
        if not view_step(lumen, points, goal, free, limit, q, work):
            break
        path[count] = q
        count += 1
        error = view_error(work.frames, goal)
        if error < least:
            least, kept = error, count
        if error < last - _GAIN:
            last, before = error, count
        elif count - before >= _STALLED:
            break
    return kept, least


@no_refcount
def view_error(frames: Array, goal: ViewGoal) -> float:
    """The larger of the view's two errors, of angle and distance, each as a share of its tolerance."""
    tip = frames[len(frames) - 1]
    x, y, z = 0.0, 0.0, 0.0
    x = goal.point[0] - tip[0, 3] - goal.ahead * tip[0, 2]
    y = goal.point[1] - tip[1, 3] - goal.ahead * tip[1, 2]
    z = goal.point[2] - tip[2, 3] - goal.ahead * tip[2, 2]
    away = math.sqrt(x * x + y * y + z * z)
    if away <= 0.0:
        return math.inf
    cosine = (x * tip[0, 2] + y * tip[1, 2] + z * tip[2, 2]) / away
    off = math.acos(min(max(cosine, -1.0), 1.0)) / goal.angle
    return max(off, abs(away - goal.distance) / goal.tolerance)


@no_refcount
def measured(lumen: DistalPathway, q: Array, work: SearchWorkspace) -> None:
    """Poses and deviations of the links at joints q (2L,)."""
    snake_frames(q, lumen.base, lumen.length, work.frames)
    found = Deviations(work.depth, work.vertex, work.segment)
    link_deviations(lumen.packed, lumen.blocks, lumen.window, work.frames, found, work.work)


@no_refcount
def put_joints(lumen: DistalPathway, work: SearchWorkspace) -> None:
    """Axes and centres (2L, 3) of the joints at the links' poses."""
    for joint in range(len(work.step)):
        link = joint // 2
        for k in range(3):
            work.centres[joint, k] = lumen.base[k, 3] if link == 0 else work.frames[link - 1, k, 3]
            if joint % 2 == 1:
                work.axes[joint, k] = work.frames[link, k, 1]
            else:
                work.axes[joint, k] = lumen.base[k, 0] if link == 0 else work.frames[link - 1, k, 0]


@no_refcount
def put_rows(lumen: DistalPathway, points: Array, limit: Array, near: float, work: SearchWorkspace) -> None:
    """Of each link that is near to its limit or beyond, how its deepest vertex' deviation changes by the joints.

    Rows (L, 2L) in mm/rad and slack (L,) in mm, infinite for other links.
    """
    for link in range(len(work.frames)):
        work.slack[link] = math.inf
        left = limit[link] - work.depth[link]
        if left > near or work.depth[link] <= 0.0:
            continue
        pose, v = work.frames[link], work.vertex[link]
        x = pose[0, 0] * points[v, 0] + pose[0, 1] * points[v, 1] + pose[0, 2] * points[v, 2] + pose[0, 3]
        y = pose[1, 0] * points[v, 0] + pose[1, 1] * points[v, 1] + pose[1, 2] * points[v, 2] + pose[1, 3]
        z = pose[2, 0] * points[v, 0] + pose[2, 1] * points[v, 1] + pose[2, 2] * points[v, 2] + pose[2, 3]
        gap, a, b, c = section_distance(x, y, z, lumen.packed.rows, lumen.packed.polar, work.segment[link])
        if not gap > 0.0:
            continue
        work.slack[link] = left
        a, b, c = (x - a) / gap, (y - b) / gap, (z - c) / gap
        for joint in range(len(work.step)):
            work.rows[link, joint] = 0.0
            if joint // 2 <= link:
                u, v_, w = work.axes[joint, 0], work.axes[joint, 1], work.axes[joint, 2]
                rx, ry, rz = x - work.centres[joint, 0], y - work.centres[joint, 1], z - work.centres[joint, 2]
                work.rows[link, joint] = a * (v_ * rz - w * ry) + b * (w * rx - u * rz) + c * (u * ry - v_ * rx)


@no_refcount
def view_step(
    lumen: DistalPathway, points: Array, goal: ViewGoal, free: Array, limit: Array, q: Array, work: SearchWorkspace
) -> bool:
    """Move q (2L,) by a step of the search and back within the bounds; False where no step is possible."""
    joints = len(q)
    for scale in (1.0, 0.4, 0.1):
        measured(lumen, q, work)
        put_joints(lumen, work)
        put_rows(lumen, points, limit, _NEAR_MM, work)
        if not towards(lumen, goal, free, q, work):
            return False
        for k in range(joints):
            work.tried[k] = min(max(q[k] + scale * work.step[k], -lumen.q_max), lumen.q_max)
        for _ in range(_RESTORED):
            measured(lumen, work.tried, work)
            beyond = 0.0
            for link in range(len(limit)):
                beyond = max(beyond, work.depth[link] - limit[link])
            if beyond <= 0.0:
                break
            put_joints(lumen, work)
            put_rows(lumen, points, limit, 0.0, work)
            restore(lumen, free, work)
        if beyond <= 0.0:
            moved = 0.0
            for k in range(joints):
                moved = max(moved, abs(work.tried[k] - q[k]))
                q[k] = work.tried[k]
            return moved > 1e-5
    return False


@no_refcount
def towards(lumen: DistalPathway, goal: ViewGoal, free: Array, q: Array, work: SearchWorkspace) -> bool:
    """The step (2L,) of joints that reduces the errors of the view, no joint by more than ``_MOST``."""
    tip = work.frames[len(work.frames) - 1]
    cx, cy, cz = (
        tip[0, 3] + goal.ahead * tip[0, 2], tip[1, 3] + goal.ahead * tip[1, 2], tip[2, 3] + goal.ahead * tip[2, 2]
    )  # fmt: skip
    dx, dy, dz = goal.point[0] - cx, goal.point[1] - cy, goal.point[2] - cz
    away = math.sqrt(dx * dx + dy * dy + dz * dz)
    if not away > 1e-6:
        return False
    far = max(abs(away - goal.distance) - 0.5 * goal.tolerance, 0.0)
    view = (cx, cy, cz, tip[0, 2], tip[1, 2], tip[2, 2], dx / away, dy / away, dz / away, away)
    active = 0
    for _ in range(_ROUNDS):
        put_system(view, far if away > goal.distance else -far, active, work)
        for i in range(len(q)):
            outwards = (q[i] >= lumen.q_max and work.step[i] > 0.0) or (q[i] <= -lumen.q_max and work.step[i] < 0.0)
            if free[i] == 0.0 or outwards:
                hold(work.matrix, work.step, i)
        cholesky(work.matrix, work.step)
        largest = 0.0
        for i in range(len(q)):
            largest = max(largest, abs(work.step[i]))
        if largest > _MOST:
            for i in range(len(q)):
                work.step[i] *= _MOST / largest
        more = crossed(active, work)
        if more == active:
            break
        active = more
    return True


@no_refcount
def put_system(view: ViewLine, far: float, active: int, work: SearchWorkspace) -> None:
    """The normal equations of a step (2L,): errors of the view and, of active links, what they are beyond their limit.

    far: mm that the camera is too far away, negative: too near.
    """
    joints, square = len(work.step), _PER_MM * _PER_MM
    ex, ey, ez = view[3] - view[6], view[4] - view[7], view[5] - view[8]
    for i in range(joints):
        ax, ay, az, ar = view_column(work, i, view)
        work.step[i] = -(ax * ex + ay * ey + az * ez) - square * ar * far
        for j in range(i + 1):
            bx, by, bz, br = view_column(work, j, view)
            work.matrix[i, j] = ax * bx + ay * by + az * bz + (square * ar * br if far != 0.0 else 0.0)
        work.matrix[i, i] += _DAMPING
    for link in range(len(work.frames)):
        if active & (1 << link):
            for i in range(joints):
                work.step[i] += _WALL * _WALL * work.rows[link, i] * work.slack[link]
                for j in range(i + 1):
                    work.matrix[i, j] += _WALL * _WALL * work.rows[link, i] * work.rows[link, j]


@no_refcount
def crossed(active: int, work: SearchWorkspace) -> int:
    """The active links, a bit for each, with those that the step brings beyond their limit to first order."""
    more = active
    for link in range(len(work.frames)):
        if work.slack[link] < math.inf:
            deeper = 0.0
            for i in range(len(work.step)):
                deeper += work.rows[link, i] * work.step[i]
            if deeper > work.slack[link]:
                more |= 1 << link
    return more


@no_refcount
def view_column(work: SearchWorkspace, joint: int, view: ViewLine) -> tuple[float, float, float, float]:
    """Derivatives of the view's error z − d by a joint, 1/rad, and of the distance, mm/rad."""
    cx, cy, cz, zx, zy, zz, dx, dy, dz, away = view
    u, v, w = work.axes[joint, 0], work.axes[joint, 1], work.axes[joint, 2]
    rx, ry, rz = cx - work.centres[joint, 0], cy - work.centres[joint, 1], cz - work.centres[joint, 2]
    mx, my, mz = v * rz - w * ry, w * rx - u * rz, u * ry - v * rx  # of the camera
    along = mx * dx + my * dy + mz * dz
    return (
        v * zz - w * zy + (mx - along * dx) / away,
        w * zx - u * zz + (my - along * dy) / away,
        u * zy - v * zx + (mz - along * dz) / away,
        -along,
    )


@no_refcount
def restore(lumen: DistalPathway, free: Array, work: SearchWorkspace) -> None:
    """Move the tried joints by the least step that brings the links back to their limits, to first order."""
    joints = len(work.step)
    for i in range(joints):
        for j in range(joints):
            work.matrix[i, j] = 1e-3 if i == j else 0.0
        work.step[i] = 0.0
    for link in range(len(work.frames)):
        if work.slack[link] < math.inf:
            for i in range(joints):
                work.step[i] += work.rows[link, i] * 1.1 * work.slack[link]
                for j in range(i + 1):
                    work.matrix[i, j] += work.rows[link, i] * work.rows[link, j]
    for i in range(joints):
        if free[i] == 0.0:
            hold(work.matrix, work.step, i)
    cholesky(work.matrix, work.step)
    for i in range(joints):
        work.tried[i] = min(max(work.tried[i] + min(max(work.step[i], -_MOST), _MOST), -lumen.q_max), lumen.q_max)


@no_refcount
def hold(matrix: Array, right: Array, k: int) -> None:
    """Take an unknown out of a symmetric system, of which the lower half counts: it is 0."""
    for j in range(len(right)):
        if j < k:
            matrix[k, j] = 0.0
        elif j > k:
            matrix[j, k] = 0.0
    matrix[k, k], right[k] = 1.0, 0.0


@no_refcount
def cholesky(matrix: Array, right: Array) -> None:
    """Solve a positive definite system, of which the lower half counts, in place."""
    n = len(right)
    for i in range(n):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = math.sqrt(max(total, 1e-12)) if i == j else total / matrix[j, j]
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]
