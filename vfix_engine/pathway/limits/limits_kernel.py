"""Compiled certificate of one motion of a snake: poses are measured, and the motion is bisected where necessary.

The proof is in docs/safety.md, "The snake in its pathway".
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled
from ...robots.snake_kernel import snake_frames
from ..packed import INSCRIBED_RADIUS, LIPSCHITZ, PackedPathway
from ..query.query_blocks import VertexBlocks
from ..query.query_fast import Deviations, link_deviations
from ..query.query_simd import WORK
from .limits_vertices import far_from_disc, vertices_are_kept

# Offsets in the array of the robot's and the certificate's constants.
LENGTH, REACH, TOLERANCE, LOW, HIGH = 0, 1, 2, 3, 6
SHAPE_SIZE = 9
LEAST_PART = 1.0 / 4096.0  # smallest part of a motion; one that requires further bisection is refused
MOST_POSES = 64  # of a motion; one that needs more is refused, to limit the duration of a step
DEEPEST = 0.9  # of a window's smallest inscribed radius: the Lipschitz constant is proven for deviations up to that


@compiled
def unfit_window(window: IntArray, segments: int) -> int:
    """Return the first link whose window (L, 2) is empty or exceeds the number of segments; -1 if there is none."""
    for link in range(window.shape[0]):
        if not 0 <= window[link, 0] < window[link, 1] <= segments:
            return link
    return -1


@compiled
def unfit_bound(bound: Array) -> int:
    """Return the first link whose bound (L,) is below 0 or not a number; -1 if there is none."""
    for link in range(len(bound)):
        if not bound[link] >= 0.0:
            return link
    return -1


@compiled
def certify_motion(
    rows: Array,
    polar: Array,
    window: IntArray,
    base: Array,
    q: Array,
    base_end: Array,
    q_end: Array,
    shape: Array,
    bound: Array,
    known: Array,
    lanes: Array,
    ball: Array,
    start: IntArray,
    index: IntArray,
    depth: Array,
    vertex: IntArray,
    segment: IntArray,
) -> tuple[float, int]:
    """Fraction of the motion from (base, q) to (base_end, q_end) that is certified, from its start, and measured poses.

    Joints and the base's origin are interpolated linearly, the base rotates about one axis. A link may be as deep as
    its bound, or as deep as at the start if that is more and known. Shapes and windows are not checked here:
    ``limits.py`` does.

    Args:
        window: (L, 2); base, base_end: (4, 4) transform_base_to_patient; q, q_end: (2L,).
        shape: (SHAPE_SIZE,) length of a link, reach, tolerance, lowest and highest corner of a link's vertices.
        bound: (L,) mm; known: (L,) mm, depth at which a link may start and stay.
        lanes, ball, start, index: of ``vertex_blocks``.
        depth, vertex, segment: (L,) out, the deviations of the last measured pose: the end of the motion if all of it
            is certified, else the refused pose.
    """
    links = window.shape[0]
    here, there = np.empty((links, 3, 4)), np.empty((links, 3, 4))
    pose, joints, before = np.empty((4, 4)), np.empty(2 * links), np.empty(links)
    limit, acceleration, turn, work = np.empty(links), np.empty(links), np.empty(3), np.empty(WORK)
    steep, level = np.empty(links), np.empty(links)
    _turn_between(base, base_end, turn)
    if not _accelerations(q, q_end, turn, shape, acceleration):
        return 0.0, 0
    _place(base, base_end, turn, q, q_end, 0.0, pose, joints)
    snake_frames(joints, pose, shape[LENGTH], here)
    packed, blocks = PackedPathway(rows, polar), VertexBlocks(lanes, ball, start, index)
    link_deviations(packed, blocks, window, here, Deviations(before, vertex, segment), work)
    for link in range(links):
        limit[link] = max(bound[link], min(before[link], known[link]))
        depth[link] = before[link]
        level[link], steep[link] = lipschitz_to_depth(
            rows, window[link, 0], window[link, 1], limit[link], shape[TOLERANCE]
        )
    for link in range(links):
        if not (before[link] <= limit[link] and before[link] < np.inf):
            return 0.0, 1
    done, size, poses = 0.0, 1.0, 1
    while done < 1.0 and size >= LEAST_PART and poses < MOST_POSES:
        to = min(1.0, done + size)
        _place(base, base_end, turn, q, q_end, to, pose, joints)
        snake_frames(joints, pose, shape[LENGTH], there)
        link_deviations(packed, blocks, window, there, Deviations(depth, vertex, segment), work)
        poses += 1
        for link in range(links):
            if not depth[link] <= limit[link]:
                return done, poses
        if not _motion_is_kept(
            rows,
            polar,
            window,
            here,
            there,
            lanes,
            start,
            before,
            depth,
            acceleration,
            steep,
            level,
            to - done,
            limit,
            shape,
        ):
            size *= 0.5
            continue
        for link in range(links):
            before[link] = depth[link]
            for row in range(3):
                for column in range(4):
                    here[link, row, column] = there[link, row, column]
        done, size = to, 2.0 * size
    return done, poses


@compiled
def _motion_is_kept(
    rows: Array,
    polar: Array,
    window: IntArray,
    here: Array,
    there: Array,
    lanes: Array,
    start: IntArray,
    before: Array,
    after: Array,
    acceleration: Array,
    steep: Array,
    level: Array,
    part: float,
    limit: Array,
    shape: Array,
) -> bool:
    """Whether every link stays within its limit plus the tolerance between two measured poses.

    Tested for the link as a whole if neither pose is deeper than ``level`` (lemma 6), else vertex by vertex (lemma 7).
    """
    tolerance, low_high = shape[TOLERANCE], shape[LOW : HIGH + 3]
    for link in range(len(before)):
        if limit[link] == np.inf:
            continue
        travel = _chord(here[link], there[link], shape) + 0.25 * acceleration[link] * part * part
        summed, first, last = before[link] + after[link], window[link, 0], window[link, 1]
        whole = max(before[link], after[link]) <= level[link]
        whole = whole and 0.5 * (summed + steep[link] * travel) <= level[link] + tolerance
        ends = (
            far_from_disc(rows, first, False, here[link], low_high, travel)
            and far_from_disc(rows, first, False, there[link], low_high, travel)
            and far_from_disc(rows, last - 1, True, here[link], low_high, travel)
            and far_from_disc(rows, last - 1, True, there[link], low_high, travel)
        )
        if whole and ends:
            continue
        if ends and level[link] == limit[link]:  # inscribed radii exceed the limit sufficiently: bisection is cheaper
            return False
        most = limit[link] + tolerance
        if not (
            0.5 * (summed + travel) <= most
            and vertices_are_kept(
                rows, polar, first, last, here[link], there[link], lanes, start[link], start[link + 1], low_high,
                travel, level[link] + tolerance, steep[link], most,
            )
        ):  # fmt: skip
            return False
    return True


@compiled
def lipschitz_to_depth(rows: Array, first: int, last: int, limit: float, tolerance: float) -> tuple[float, float]:
    """Return a depth in mm for a window, and the Lipschitz constant Λ up to that depth plus the tolerance.

    The depth is the limit, or less if limit plus tolerance exceeds ``DEEPEST`` of the smallest inscribed radius c: then
    depth plus tolerance equals that. A point that deviates by δ has h ≥ c - δ from the axis of the segment it is
    measured to, and Λ = √(1 + (K / h)²); see ``clearance.lipschitz_constant``.
    """
    narrowest = np.inf
    for j in range(first, last):
        narrowest = min(narrowest, rows[j, INSCRIBED_RADIUS])
    level, steep = min(limit, DEEPEST * narrowest - tolerance), 1.0
    for j in range(first, last):
        inscribed = rows[j, INSCRIBED_RADIUS]
        height = inscribed - level - tolerance
        turned = 0.25 * (rows[j, LIPSCHITZ] * rows[j, LIPSCHITZ] - 1.0) * inscribed * inscribed
        steep = max(steep, sqrt(1.0 + turned / (height * height)))
    return level, steep


@compiled
def _chord(here: Array, there: Array, shape: Array) -> float:
    """Largest displacement in mm of a link's vertices: that of a corner of their box, by convexity."""
    longest = 0.0
    for corner in range(8):
        x = shape[LOW] if corner & 1 else shape[HIGH]
        y = shape[LOW + 1] if corner & 2 else shape[HIGH + 1]
        z = shape[LOW + 2] if corner & 4 else shape[HIGH + 2]
        square = 0.0
        for row in range(3):
            a = there[row, 0] - here[row, 0]
            b = there[row, 1] - here[row, 1]
            c = there[row, 2] - here[row, 2]
            travel = a * x + b * y + c * z + there[row, 3] - here[row, 3]
            square += travel * travel
        longest = max(longest, square)
    return sqrt(longest)


@compiled
def _accelerations(q: Array, q_end: Array, turn: Array, shape: Array, acceleration: Array) -> bool:
    """Bound (L,) in mm the second derivative of every link's vertices during the motion; False if it is NaN."""
    turned = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    summed = 0.0  # of the previous links, each as long as ``length``
    for link in range(len(acceleration)):
        turned += abs(q_end[2 * link] - q[2 * link]) + abs(q_end[2 * link + 1] - q[2 * link + 1])
        acceleration[link] = summed + shape[REACH] * turned * turned
        summed += shape[LENGTH] * turned * turned
        if not acceleration[link] < np.inf:
            return False
    return True


@compiled
def _turn_between(base: Array, base_end: Array, turn: Array) -> None:
    """Rotation vector (3,) in the patient frame from one base to the other; NaN for a rotation of or near π."""
    trace = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[i] = 0.0
        for c in range(3):
            turn[i] += 0.5 * (base_end[k, c] * base[j, c] - base_end[j, c] * base[k, c])
            trace += base_end[i, c] * base[i, c]
    sine, cosine = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]), 0.5 * (trace - 1.0)
    angle = atan2(sine, cosine)
    factor = 1.0 if sine < 1e-12 else angle / sine
    if angle > 3.0:
        factor = np.nan
    for i in range(3):
        turn[i] *= factor


@compiled
def _place(
    base: Array, base_end: Array, turn: Array, q: Array, q_end: Array, to: float, pose: Array, joints: Array
) -> None:
    """Compute the pose at fraction ``to`` of the motion; at 1 it is exactly the end."""
    angle = to * sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    x, y, z = turn[0], turn[1], turn[2]
    if angle > 0.0:
        x, y, z = to * x / angle, to * y / angle, to * z / angle
    sine, rest = sin(angle), 1.0 - cos(angle)
    for c in range(4):
        a, b, d = base[0, c], base[1, c], base[2, c]
        if to == 1.0:
            pose[0, c], pose[1, c], pose[2, c] = base_end[0, c], base_end[1, c], base_end[2, c]
        elif c == 3:
            for row in range(3):
                pose[row, 3] = base[row, 3] + to * (base_end[row, 3] - base[row, 3])
        else:  # Rodrigues' formula
            along = rest * (x * a + y * b + z * d)
            pose[0, c] = a + sine * (y * d - z * b) - rest * a + along * x
            pose[1, c] = b + sine * (z * a - x * d) - rest * b + along * y
            pose[2, c] = d + sine * (x * b - y * a) - rest * d + along * z
    for joint in range(len(q)):
        joints[joint] = q_end[joint] if to == 1.0 else q[joint] + to * (q_end[joint] - q[joint])
