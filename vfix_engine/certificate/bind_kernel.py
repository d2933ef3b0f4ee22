"""Selection of the pairs that can be active in the next step, out of hundreds, compiled.

A pair's row is −n·ΔP ≤ bound, and no point of segment s moves further than m_s in one step within the joint bounds:
a row with a bound of m_s or more holds for every such step and is left out without effect on the solution.
Those joint bounds include the accelerations. The program of an emergency has wider ones (``joint_bounds``), which may
violate a row that was left out; as with every row, the certificate then refuses a motion that comes too near.
Of the remaining rows, nearly redundant ones are dropped, nearest first kept (``geometry.pairs.select``).
A dropped row nearly equals a nearer one; where the difference matters, the certificate refuses the step.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Int32Array
from ..kernels.compiled import compiled
from ..proximity.pairs import COSINE, MAX_ROWS, RADIUS_MM, select
from ..virtual_fixtures.state_kernel import BODY, SEGMENT, TRIANGLE
from ..virtual_fixtures.stopping import stopping_distance
from .constants import StepConstants


@compiled
def largest_moves(box: Array, position: Array, jacobian: Array, start: Array, end: Array, move: Array) -> None:
    """Bound (S,) in mm of the displacement of any point of each segment in the next step, reached at one of its ends.

    Args:
        box: (2, n) lower and upper bounds of Δq, see ``step_box``.
    """
    n = box.shape[1]
    for s in range(len(move)):
        move[s] = 0.0
        for side in range(2):
            point = start[s] if side == 0 else end[s]
            x, y, z = point[0] - position[0], point[1] - position[1], point[2] - position[2]
            total = 0.0
            for j in range(n):
                a, b, c = jacobian[3, j], jacobian[4, j], jacobian[5, j]
                u = jacobian[0, j] + b * z - c * y
                v = jacobian[1, j] + c * x - a * z
                w = jacobian[2, j] + a * y - b * x
                total += max(abs(box[0, j]), abs(box[1, j])) * np.sqrt(u * u + v * v + w * w)
            move[s] = max(move[s], total)


@compiled
def binding(
    constants: StepConstants, move: Array, rows: Array, labels: Int32Array, body: Int32Array, found: int, pairs: Array
) -> int:
    """Write the pairs that can be active, at least one, by increasing distance to their margin; return their number.

    The nearest of all pairs is always the first: if it cannot be active but a pair of a faster segment can, both are
    written.

    Args:
        move: (S,) from ``largest_moves``; rows, labels, body: the ``found`` pairs of ``measure``.
        pairs: (MAX_ROWS, 13) out, see ``state_kernel``.
    """
    limit = np.empty(len(move))
    for s in range(len(move)):
        limit[s] = stopping_distance(move[s], constants.change)
    free, nearest = np.empty(found), 0
    for i in range(found):
        free[i] = rows[i, 0] - constants.buffered_margin[body[i]]
        if free[i] < free[nearest]:
            nearest = i
    waiting, slack = np.empty(found, np.int32), np.empty(found)
    left = 0
    for i in range(found):
        if i == nearest or free[i] < limit[labels[i, 0]]:
            waiting[left], slack[left] = i, free[i]
            left += 1
    if left == 1:
        _write_pair(rows, labels, body, nearest, pairs[0])
        return 1
    normal, point, segment = np.empty((left, 3)), np.empty((left, 3)), np.empty(left, np.int32)
    for i in range(left):
        row = rows[waiting[i]]
        for k in range(3):
            normal[i, k], point[i, k] = row[1 + k], row[4 + k]
        segment[i] = labels[waiting[i], 0]
    chosen = select(slack[:left], normal, point, segment, MAX_ROWS, COSINE, RADIUS_MM)
    for i in range(len(chosen)):
        _write_pair(rows, labels, body, waiting[chosen[i]], pairs[i])
    return len(chosen)


@compiled
def _write_pair(rows: Array, labels: Int32Array, body: Int32Array, source: int, pair: Array) -> None:
    for k in range(10):
        pair[k] = rows[source, k]
    pair[SEGMENT], pair[TRIANGLE], pair[BODY] = labels[source, 0], labels[source, 1], body[source]
