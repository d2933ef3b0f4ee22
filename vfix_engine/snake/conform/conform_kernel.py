"""Bounded least squares for a snake that cannot have all its joint centres on a curve; compiled.

Unknowns: the 2L joint angles and the feed, the arc length of the base. Each joint centre and each link's midpoint
should be on the curve, and above all within the slack around it. A point's force and its stiffness enter the gradient
and the Gauss-Newton matrix as in the composite rigid body algorithm, so both take O(L²).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ...arrays import Array
from ...kernels.compiled import no_refcount
from ...robots.snake_kernel import snake_frames
from .joint_places import frame_on_curve, on_curve

# Columns of ``weights``: what they multiply is a squared distance in mm².
CENTRE, SLACK, MIDDLE, GUIDE, TIP, STAY, STEEP = range(7)
_GUIDED = 10.0  # [mm] before the curve's start, over which the guidance sets in


@no_refcount
def nearest_on_curve(points: Array, tangents: Array, step: float, near: float, joint: Array) -> float:
    """Arc length of the curve's point nearest to ``joint`` (3,), searched from ``near``."""
    last = len(points) - 1
    index, came, share = min(max(int(near / step), 0), last - 1), 0, 0.0
    for _ in range(last):
        square = along = 0.0
        for k in range(3):
            ahead = points[index + 1, k] - points[index, k]
            square, along = square + ahead * ahead, along + ahead * (joint[k] - points[index, k])
        share = along / square
        if share < 0.0 and index > 0:
            if came > 0:
                return index * step  # behind this piece and beyond the last: the sample between them
            index, came = index - 1, -1
        elif share > 1.0 and index < last - 1:
            if came < 0:
                return (index + 1) * step
            index, came = index + 1, 1
        else:
            break
    if 0.0 <= share <= 1.0:
        return (index + share) * step
    end = 0 if share < 0.0 else last
    beyond = 0.0
    for k in range(3):
        beyond += (joint[k] - points[end, k]) * tangents[end, k]
    return min(beyond, 0.0) if share < 0.0 else last * step + max(beyond, 0.0)


@no_refcount
def _pull(off: Array, ahead: Array, free: float, centre: float, weights: Array, force: Array, stiff: Array) -> float:
    """Cost of a point that is ``off`` (3,) the curve of tangent ``ahead`` (3,); its gradient and second derivative.

    ½ centre ‖off‖² + ½ slack e² (1 + (e / steep)²) with e = ‖off‖ − free where that is positive: outside the
    slack the cost grows fast, so that the worst link is corrected first.
    """
    size = math.sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2])
    beyond = max(size - free, 0.0)
    ratio = (beyond / weights[STEEP]) ** 2
    slack = weights[SLACK]
    side = centre + (slack * beyond * (1.0 + 2.0 * ratio) / size if beyond > 0.0 else 0.0)
    radial = centre + (slack * (1.0 + 6.0 * ratio) if beyond > 0.0 else 0.0)
    extra = (radial - side) / (size * size) if size > 1e-9 else 0.0
    for i in range(3):
        force[i] = side * off[i]
        for k in range(3):
            stiff[i, k] = (side if i == k else 0.0) - side * ahead[i] * ahead[k] + extra * off[i] * off[k]
    cost: float = 0.5 * centre * size * size + 0.5 * slack * beyond * beyond * (1.0 + ratio)
    return cost


@no_refcount
def _gather(x: float, y: float, z: float, force: Array, stiff: Array, wrench: Array, stiffness: Array) -> None:
    """Add a point's force and stiffness to the wrench (6,) and the matrix (6, 6) of twists about the origin.

    A twist (ω, v) moves the point by v + ω × p, the matrix B = (−[p]×, 1); wrench += Bᵀ force, stiffness += Bᵀ stiff B.
    """
    wrench[0] += y * force[2] - z * force[1]
    wrench[1] += z * force[0] - x * force[2]
    wrench[2] += x * force[1] - y * force[0]
    for k in range(3):
        wrench[3 + k] += force[k]
    for i in range(3):  # stiff B, row by row, and then Bᵀ from the left
        a, b, c = stiff[i, 0], stiff[i, 1], stiff[i, 2]
        row = (y * c - z * b, z * a - x * c, x * b - y * a, a, b, c)
        for k in range(6):
            stiffness[3 + i, k] += row[k]
            if i == 0:
                stiffness[1, k] += z * row[k]
                stiffness[2, k] -= y * row[k]
            elif i == 1:
                stiffness[0, k] -= z * row[k]
                stiffness[2, k] += x * row[k]
            else:
                stiffness[0, k] += y * row[k]
                stiffness[1, k] -= x * row[k]


class CurveSamples(NamedTuple):
    """A curve and the slack about it: points, tangents and transported across (N, 3), slack (N,), step mm."""

    points: Array
    tangents: Array
    across: Array
    slack: Array
    step: float


class ChainTask(NamedTuple):
    """Parameters of the cost: links of ``chord`` mm, the base rotated by ``roll`` about the curve, the tip's position.

    weights: (7,) by the columns above; near: (2L + 1,) preferred angles.
    """

    chord: float
    roll: float
    tip: float
    weights: Array
    near: Array


class Body(NamedTuple):
    """Output of ``shape_cost``: base (3, 4), frames (L, 3, 4), wrench (L, 6) and stiffness (L, 6, 6); work (7, 3)."""

    base: Array
    frames: Array
    wrench: Array
    stiffness: Array
    work: Array


@no_refcount
def shape_cost(line: CurveSamples, task: ChainTask, state: Array, places: Array, body: Body) -> float:
    """Cost of a state (2L + 1,), angles and feed, with each link's own wrench and stiffness in ``body``.

    places: (2L,) arc lengths of the midpoint and the far end of every link, in and out.
    """
    points, tangents, step, slack = line.points, line.tangents, line.step, line.slack
    chord, tip, weights, near = task.chord, task.tip, task.weights, task.near
    base, frames, wrench, stiffness, work = body.base, body.frames, body.wrench, body.stiffness, body.work
    links = len(frames)
    frame_on_curve(points, tangents, line.across, step, state[2 * links], task.roll, base)
    snake_frames(state, base, chord, frames)
    ahead, off, force, stiff, place = work[0], work[1], work[2], work[3:6], work[6]
    for link in range(links):
        for i in range(6):
            wrench[link, i] = 0.0
            for k in range(6):
                stiffness[link, i, k] = 0.0
    cost = 0.0
    for link in range(links):
        for part in range(2):
            back = 0.5 * chord if part == 0 else 0.0
            for k in range(3):
                place[k] = frames[link, k, 3] - back * frames[link, k, 2]
            at = nearest_on_curve(points, tangents, step, places[2 * link + part], place)
            places[2 * link + part] = at
            end = part == 1 and link == links - 1
            on_curve(points, tangents, step, at, off)
            before = min(max(int(at / step), 0), len(points) - 1)
            for k in range(3):
                ahead[k] = tangents[before, k]
                off[k] = place[k] - off[k]
            out = min(max(-at / _GUIDED, 0.0), 1.0)
            guide = out * out * (3.0 - 2.0 * out)
            centre = weights[CENTRE] * (weights[MIDDLE] if part == 0 else 1.0)
            centre += guide * (weights[GUIDE] - centre)
            cost += _pull(off, ahead, slack[before], centre, weights, force, stiff)
            if end:  # the tip is held along the curve, too, which determines the feed
                before = min(max(int(tip / step), 0), len(points) - 1)
                on_curve(points, tangents, step, tip, off)
                slip = 0.0
                for k in range(3):
                    ahead[k] = tangents[before, k]
                    slip += ahead[k] * (place[k] - off[k])
                cost += 0.5 * weights[TIP] * slip * slip
                for i in range(3):
                    force[i] += weights[TIP] * slip * ahead[i]
                    for k in range(3):
                        stiff[i, k] += weights[TIP] * ahead[i] * ahead[k]
            _gather(place[0], place[1], place[2], force, stiff, wrench[link], stiffness[link])
    for i in range(2 * links):
        cost += 0.5 * weights[STAY] * (state[i] - near[i]) ** 2
    return cost


@no_refcount
def _feed_twist(line: CurveSamples, base: Array, feed: float, twist: Array) -> None:
    """Twist of the whole chain as its base moves along the curve, rotating with the tangent and not about it."""
    last = len(line.points) - 1
    before = min(int(feed / line.step), last - 1)
    bx = by = bz = 0.0
    if 0.0 <= feed <= last * line.step:
        bx = (line.tangents[before + 1, 0] - line.tangents[before, 0]) / line.step
        by = (line.tangents[before + 1, 1] - line.tangents[before, 1]) / line.step
        bz = (line.tangents[before + 1, 2] - line.tangents[before, 2]) / line.step
    tx, ty, tz = base[0, 2], base[1, 2], base[2, 2]
    ax, ay, az = ty * bz - tz * by, tz * bx - tx * bz, tx * by - ty * bx
    x, y, z = base[0, 3], base[1, 3], base[2, 3]
    twist[0], twist[1], twist[2] = ax, ay, az
    twist[3], twist[4], twist[5] = tx + y * az - z * ay, ty + z * ax - x * az, tz + x * ay - y * ax


@no_refcount
def normal_matrix(
    line: CurveSamples,
    task: ChainTask,
    body: Body,
    state: Array,
    twists: Array,
    moved: Array,
    gradient: Array,
    hessian: Array,
) -> None:
    """Gradient (2L + 1,) and Gauss-Newton matrix from wrenches and stiffnesses, which become those of all links beyond.

    twists: (2L + 1, 6) and moved: (6,) work.
    """
    base, frames, wrench, stiffness = body.base, body.frames, body.wrench, body.stiffness
    stay, near = task.weights[STAY], task.near
    links, size = len(frames), len(gradient)
    for link in range(links - 2, -1, -1):
        for i in range(6):
            wrench[link, i] += wrench[link + 1, i]
            for k in range(6):
                stiffness[link, i, k] += stiffness[link + 1, i, k]
    for joint in range(2 * links):
        link = joint // 2
        before = frames[max(link - 1, 0)] if link > 0 else base
        turn = frames[link] if joint % 2 == 1 else before
        column = joint % 2
        ax, ay, az = turn[0, column], turn[1, column], turn[2, column]
        x, y, z = before[0, 3], before[1, 3], before[2, 3]
        twists[joint, 0], twists[joint, 1], twists[joint, 2] = ax, ay, az
        twists[joint, 3], twists[joint, 4], twists[joint, 5] = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    _feed_twist(line, base, state[size - 1], twists[size - 1])
    for column in range(size):
        feed = column == size - 1
        link = 0 if feed else column // 2
        total = 0.0
        for i in range(6):
            total += twists[column, i] * wrench[link, i]
            moved[i] = 0.0
            for k in range(6):
                moved[i] += stiffness[link, i, k] * twists[column, k]
        gradient[column] = total + (0.0 if feed else stay * (state[column] - near[column]))
        for row in range(column + 1):
            total = 0.0
            for i in range(6):
                total += twists[row, i] * moved[i]
            hessian[row, column] = total
            hessian[column, row] = total
        hessian[column, column] += 0.0 if feed else stay
    # The feed moves all links: its products are those with each joint's own links beyond.
    for row in range(size - 1):
        total = 0.0
        for i in range(6):
            part = 0.0
            for k in range(6):
                part += stiffness[row // 2, i, k] * twists[row, k]
            total += twists[size - 1, i] * part
        hessian[row, size - 1], hessian[size - 1, row] = total, total
