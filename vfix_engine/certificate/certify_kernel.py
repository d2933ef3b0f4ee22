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

from ..arrays import Array, IntArray
from ..kernels.compiled import compiled, merged, no_refcount
from ..virtual_fixtures.joint_limits import step_box
from ..virtual_fixtures.state_kernel import BROKEN_COUNT, PAIR_COUNT, StateViews, state_views
from .bind_kernel import binding, binding_slack
from .constants import CandidateTriangles, StepConstants
from .inputs import Inputs, unpack_inputs
from .measure_kernel import candidates_suffice, measure, measure_distances, place
from .sweep_kernel import acceleration_bound, chords

AT_LIMIT = 1e-6  # [mm or rad] tolerance of solvers: a step that exceeds a joint's range by less ends at its limit
SWEEP_TOLERANCE_MM = 1e-3  # how far the bound between two poses may be below the margin
HALVINGS = 5
_GRID = 1 << HALVINGS
_ROUNDING_MM = 1e-6  # added to distances up to which pairs are searched, far above rounding

KEPT, REFUSED, UNCOVERED, OVERFULL = range(4)  # verdicts


@no_refcount
def _above(distance: Array, floor: Array) -> bool:
    """Whether every distance is a number not below its floor."""
    for b in range(distance.shape[0]):
        for s in range(distance.shape[1]):
            if not (distance[b, s] >= floor[b, s] and distance[b, s] < np.inf):
                return False
    return True


@no_refcount
def _clear_between(one: Array, two: Array, chord: Array, sag: float, floor: Array) -> bool:
    """Whether the bound between two poses respects the floor; ``one``, ``two``: distances (B, S) at its ends."""
    for b in range(floor.shape[0]):
        for s in range(floor.shape[1]):
            least = 0.5 * (one[b, s] + two[b, s] - chord[s]) - sag
            if not least >= floor[b, s] - SWEEP_TOLERANCE_MM:
                return False
    return True


@compiled
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
        measure_distances(constants, candidates, starts[middle], ends[middle], distances[middle])
        if not _above(distances[middle], floor):
            return REFUSED
        stack[top, 0], stack[top, 1] = middle, j
        stack[top + 1, 0], stack[top + 1, 1] = i, middle
        top += 2
    return KEPT


@merged
def _write_box(constants: StepConstants, state: StateViews) -> None:
    """Write the joint bounds of a state's next step."""
    state.counts[BROKEN_COUNT] = step_box(
        state.q, state.velocity, constants.lower, constants.upper, constants.speed, constants.acceleration,
        constants.dt, state.box[0], state.box[1],
    )  # fmt: skip


@merged
def _write_pairs(inputs: Inputs, state: StateViews, found: int) -> None:
    """Write the pairs of a measured state that can be active in its next step."""
    state.counts[PAIR_COUNT] = 0
    if found > 0:
        state.counts[PAIR_COUNT] = binding(
            inputs.constants, inputs.scratch.slack, inputs.rows, inputs.labels, inputs.order, found, state.pairs
        )


@no_refcount
def measure_state(table: IntArray, numbers: Array) -> tuple[int, int]:
    """Complete a packed state whose joints and velocity are set.

    Args:
        table: see ``inputs.unpack_inputs``.

    Returns:
        KEPT, UNCOVERED or OVERFULL, and the required number of rows, see ``certify_motion``.
    """
    inputs = unpack_inputs(table)
    constants, within = inputs.constants, inputs.scratch.within
    state = state_views(numbers, len(constants.lower), len(constants.radius), len(constants.margin))
    place(constants, state.q, state.position, state.rotation, state.jacobian, state.start, state.end)
    if not candidates_suffice(constants, inputs.candidates, state.start, state.end):
        return UNCOVERED, 0
    for b in range(within.shape[0]):
        for s in range(within.shape[1]):
            within[b, s] = constants.threshold
    found = measure(inputs, state.start, state.end, within, state.distance)
    if found > len(inputs.rows):
        return OVERFULL, found
    _write_box(constants, state)
    binding_slack(constants, state, inputs.scratch.slack)
    _write_pairs(inputs, state, found)
    return KEPT, 0


@no_refcount
def certify_motion(table: IntArray, before: Array, step: Array, after: Array) -> tuple[int, int, float]:
    """``certify`` with the inputs in a table, see ``inputs.unpack_inputs``."""
    return certify(unpack_inputs(table), before, step, after)


@merged
def certify(inputs: Inputs, before: Array, step: Array, after: Array) -> tuple[int, int, float]:
    """Certify the motion from the packed state ``before`` by ``step`` (n,), and write the state at its end.

    Args:
        after: out, a packed state (see ``state_kernel``); its pose is written for every verdict.

    Returns:
        KEPT, REFUSED, UNCOVERED (gather the triangles around the end pose with the returned displacement as additional
        slack) or OVERFULL (the workspace has too few rows); the required number of rows; the largest distance in mm of
        a point of the tool during the motion from its final position.
    """
    constants, candidates = inputs.constants, inputs.candidates
    n, count, bodies = len(constants.lower), len(constants.radius), len(constants.margin)
    state, new = state_views(before, n, count, bodies), state_views(after, n, count, bodies)
    made, chord, slack, floor, within, _, _ = inputs.scratch
    for j in range(n):
        low, high = min(constants.lower[j], state.q[j]), max(constants.upper[j], state.q[j])
        new.q[j], made[j] = state.q[j] + step[j], step[j]
        if not (np.abs(step[j]) < np.inf and low - AT_LIMIT <= new.q[j] <= high + AT_LIMIT):
            return REFUSED, 0, 0.0
        if not low <= new.q[j] <= high:
            new.q[j] = min(max(new.q[j], low), high)
            made[j] = new.q[j] - state.q[j]
        new.velocity[j] = made[j] / constants.dt
    place(constants, new.q, new.position, new.rotation, new.jacobian, new.start, new.end)
    longest = chords(state.start, state.end, new.start, new.end, chord)
    curve = acceleration_bound(constants.chain, constants.links, constants.reach, state.q, made)
    displacement = longest + curve / 8.0
    if not candidates_suffice(constants, candidates, new.start, new.end):
        return UNCOVERED, 0, displacement
    _write_box(constants, new)
    binding_slack(constants, new, slack)
    _write_within(constants, state.distance, chord, slack, within)
    found = measure(inputs, new.start, new.end, within, new.distance)
    if found > len(inputs.rows):
        return OVERFULL, found, displacement
    for b in range(bodies):
        for s in range(count):
            # A surface has no inside: closer to an axis than the sweep tolerance, a crossing could go undetected.
            if b < len(candidates.frame) and state.distance[b, s] <= SWEEP_TOLERANCE_MM - constants.radius[s]:
                return REFUSED, 0, displacement
            floor[b, s] = min(state.distance[b, s], constants.margin[b])
    if not _above(new.distance, floor):
        return REFUSED, 0, displacement
    if not _clear_between(state.distance, new.distance, chord, curve / 8.0, floor):
        verdict = _clear_in_halves(
            constants, candidates, state.q, made, state.start, state.end, state.distance,
            new.start, new.end, new.distance, curve, floor,
        )  # fmt: skip
        if verdict != KEPT:
            return verdict, 0, displacement
    _write_pairs(inputs, new, found)
    return KEPT, 0, displacement


@merged
def _write_within(constants: StepConstants, distance: Array, chord: Array, slack: Array, within: Array) -> None:
    """Write up to which distances (B, S) a pair can be the nearest one at the end of a motion, or active after it.

    A distance grows by at most the chord. distance: (B, S) before the motion; slack: see ``binding_slack``.
    """
    for b in range(within.shape[0]):
        for s in range(within.shape[1]):
            far = max(distance[b, s] + chord[s], constants.buffered_margin[b] + slack[s]) + _ROUNDING_MM
            within[b, s] = far if far < constants.threshold else constants.threshold
