"""The certificate, compiled: a motion is accepted only if the tool provably keeps its distance throughout.

Between two poses the joints are interpolated linearly.
A point of the tool's axis at fraction s of the motion is at most s·h + C/8 away from its start and (1 − s)·h + C/8 from
its end, where h is the length of its chord and C bounds its second derivative (``sweep_kernel.acceleration_bound``).
The distance to an obstacle is Lipschitz continuous with constant 1, so the distance during the motion is at least
(c_0 + c_1 − h) / 2 − C/8, with c_0 and c_1 the distances at the ends (HAZ-01, HAZ-02).
If that bound is not sufficient, the motion is bisected and both halves are certified; a motion that is not certified
after ``HALVINGS`` bisections is refused.
From a state already inside a margin only motions that never decrease the clearance are accepted (HAZ-04).
No joint leaves its range, and a joint outside its range moves back or stands still (HAZ-06).
Once a surface has reached the axis of a segment the penetration depth is unknown, so no motion is accepted from there.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Float32Array, Int32Array, IntArray
from ..kernels.compiled import compiled, inlined
from ..virtual_fixtures.joint_limits import step_box
from ..virtual_fixtures.state_kernel import BROKEN_COUNT, PAIR_COUNT, StateViews, state_views
from .bind_kernel import binding, largest_moves
from .constants import CandidateTriangles, StepConstants, unpack_candidates, unpack_constants
from .measure_kernel import candidates_suffice, measure, place
from .sweep_kernel import acceleration_bound, chords

AT_LIMIT = 1e-6  # [mm or rad] tolerance of solvers: a step that exceeds a joint's range by less ends at its limit
SWEEP_TOLERANCE_MM = 1e-3  # how far the bound between two poses may be below the margin
HALVINGS = 5
_GRID = 1 << HALVINGS

KEPT, REFUSED, UNCOVERED, OVERFULL = range(4)  # verdicts


@compiled
def _above(distance: Array, floor: Array) -> bool:
    """Whether every distance is a number not below its floor."""
    for b in range(distance.shape[0]):
        for s in range(distance.shape[1]):
            if not (distance[b, s] >= floor[b, s] and distance[b, s] < np.inf):
                return False
    return True


@compiled
def _clear_between(one: Array, two: Array, chord: Array, sag: float, floor: Array) -> bool:
    """Whether the bound between two poses respects the floor; ``one``, ``two``: distances (B, S) at its ends."""
    for b in range(floor.shape[0]):
        for s in range(floor.shape[1]):
            least = 0.5 * (one[b, s] + two[b, s] - chord[s]) - sag
            if not least >= floor[b, s] - SWEEP_TOLERANCE_MM:
                return False
    return True


@inlined
def _clear_in_halves(
    constants: StepConstants, candidates: CandidateTriangles, q: Array, step: Array, start: Array, end: Array,
    distance: Array, last_start: Array, last_end: Array, last_distance: Array, curve: float, floor: Array,
) -> int:  # fmt: skip
    """Verdict on a motion that needs intermediate poses; they lie on a grid of ``_GRID`` steps."""
    n, count, bodies = len(q), len(start), len(floor)
    starts, ends = np.empty((_GRID + 1, count, 3)), np.empty((_GRID + 1, count, 3))
    distances = np.empty((_GRID + 1, bodies, count))
    for s in range(count):  # array slices would compile numba's code for shape messages, which takes seconds
        for k in range(3):
            starts[0, s, k], ends[0, s, k] = start[s, k], end[s, k]
            starts[_GRID, s, k], ends[_GRID, s, k] = last_start[s, k], last_end[s, k]
        for b in range(bodies):
            distances[0, b, s], distances[_GRID, b, s] = distance[b, s], last_distance[b, s]
    between, chord = np.empty(n), np.empty(count)
    position, rotation, jacobian = np.empty(3), np.empty((3, 3)), np.empty((6, n))
    rows, labels, body = np.empty((0, 10)), np.empty((0, 2), np.int32), np.empty(0, np.int32)
    stack = np.empty((HALVINGS + 2, 2), np.int64)
    stack[0, 0], stack[0, 1] = 0, _GRID
    top = 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        share = (j - i) / _GRID
        chords(starts[i], ends[i], starts[j], ends[j], chord)
        if _clear_between(distances[i], distances[j], chord, share * share * curve / 8.0, floor):
            continue
        if j - i == 1:
            return REFUSED
        middle = (i + j) // 2
        for k in range(n):
            between[k] = q[k] + middle / _GRID * step[k]
        place(constants, between, position, rotation, jacobian, starts[middle], ends[middle])
        if not candidates_suffice(constants, candidates, starts[middle], ends[middle]):
            return UNCOVERED
        measure(constants, candidates, starts[middle], ends[middle], -np.inf, distances[middle], rows, labels, body)
        if not _above(distances[middle], floor):
            return REFUSED
        stack[top, 0], stack[top, 1] = middle, j
        stack[top + 1, 0], stack[top + 1, 1] = i, middle
        top += 2
    return KEPT


@compiled
def _complete(
    constants: StepConstants, state: StateViews, rows: Array, labels: Int32Array, body: Int32Array, found: int
) -> None:
    """Write the joint bounds of a measured state's next step, and its pairs that can be active in that step."""
    state.counts[BROKEN_COUNT] = step_box(
        state.q, state.velocity, constants.lower, constants.upper, constants.speed, constants.acceleration,
        constants.dt, state.box[0], state.box[1],
    )  # fmt: skip
    state.counts[PAIR_COUNT] = 0
    if found > 0:
        move = np.empty(len(constants.radius))
        largest_moves(state.box, state.position, state.jacobian, state.start, state.end, move)
        state.counts[PAIR_COUNT] = binding(constants, move, rows, labels, body, found, state.pairs)


@compiled
def measure_state(
    numbers: Array, counts: IntArray,
    boxes: Float32Array, corners: Array, label: Int32Array, first: Int32Array, poses: Array,
    numbers_out: Array, rows: Array, labels: Int32Array, body: Int32Array,
) -> tuple[int, int]:  # fmt: skip
    """Complete a packed state whose joints and velocity are set.

    Args: see ``certify_motion``.

    Returns:
        KEPT, UNCOVERED or OVERFULL, and the required number of rows, see ``certify_motion``.
    """
    constants = unpack_constants(numbers, counts)
    candidates = unpack_candidates(len(constants.radius), boxes, corners, label, first, poses)
    state = state_views(numbers_out, len(constants.lower), len(constants.radius), len(constants.margin))
    place(constants, state.q, state.position, state.rotation, state.jacobian, state.start, state.end)
    if not candidates_suffice(constants, candidates, state.start, state.end):
        return UNCOVERED, 0
    found = measure(
        constants, candidates, state.start, state.end, constants.threshold, state.distance, rows, labels, body
    )  # fmt: skip
    if found > len(rows):
        return OVERFULL, found
    _complete(constants, state, rows, labels, body, found)
    return KEPT, 0


@compiled
def certify_motion(
    numbers: Array, counts: IntArray,
    boxes: Float32Array, corners: Array, label: Int32Array, first: Int32Array, poses: Array,
    before: Array, step: Array, after: Array, rows: Array, labels: Int32Array, body: Int32Array,
) -> tuple[int, int, float]:  # fmt: skip
    """Certify the motion from the packed state ``before`` by ``step`` (n,), and write the state at its end.

    Args:
        numbers, counts: a ``PackedConstants``; boxes … poses: packed candidates.
        after: out, a packed state (see ``state_kernel``); its pose is written for every verdict.
        rows, labels, body: (R, …) workspace for the pairs within the threshold.

    Returns:
        KEPT, REFUSED, UNCOVERED (gather the triangles around the end pose with the returned displacement as additional
        slack) or OVERFULL (the workspace has too few rows); the required number of rows; the largest distance in mm of
        a point of the tool during the motion from its final position.
    """
    constants = unpack_constants(numbers, counts)
    candidates = unpack_candidates(len(constants.radius), boxes, corners, label, first, poses)
    n, count, bodies = len(constants.lower), len(constants.radius), len(constants.margin)
    state, new = state_views(before, n, count, bodies), state_views(after, n, count, bodies)
    q, start, end, distance = state.q, state.start, state.end, state.distance
    new_q, new_start, new_end, new_distance = new.q, new.start, new.end, new.distance
    made = np.empty(n)  # the step, clipped to the joints' ranges
    for j in range(n):
        low, high = min(constants.lower[j], q[j]), max(constants.upper[j], q[j])
        new_q[j], made[j] = q[j] + step[j], step[j]
        if not (np.abs(step[j]) < np.inf and low - AT_LIMIT <= new_q[j] <= high + AT_LIMIT):
            return REFUSED, 0, 0.0
        if not low <= new_q[j] <= high:
            new_q[j] = min(max(new_q[j], low), high)
            made[j] = new_q[j] - q[j]
        new.velocity[j] = made[j] / constants.dt
    place(constants, new_q, new.position, new.rotation, new.jacobian, new_start, new_end)
    chord, floor = np.empty(count), np.empty((bodies, count))
    chords(start, end, new_start, new_end, chord)
    curve = acceleration_bound(constants.chain, constants.links, constants.reach, q, made)
    displacement = chord.max() + curve / 8.0
    if not candidates_suffice(constants, candidates, new_start, new_end):
        return UNCOVERED, 0, displacement
    found = measure(constants, candidates, new_start, new_end, constants.threshold, new_distance, rows, labels, body)
    if found > len(rows):
        return OVERFULL, found, displacement
    for b in range(bodies):
        for s in range(count):
            # A surface has no inside: closer to an axis than the sweep tolerance, a crossing could go undetected.
            if b < len(candidates.frame) and distance[b, s] <= SWEEP_TOLERANCE_MM - constants.radius[s]:
                return REFUSED, 0, displacement
            floor[b, s] = min(distance[b, s], constants.margin[b])
    if not _above(new_distance, floor):
        return REFUSED, 0, displacement
    if not _clear_between(distance, new_distance, chord, curve / 8.0, floor):
        verdict = _clear_in_halves(
            constants, candidates, q, made, start, end, distance, new_start, new_end, new_distance, curve, floor
        )
        if verdict != KEPT:
            return verdict, 0, displacement
    _complete(constants, new, rows, labels, body, found)
    return KEPT, 0, displacement
