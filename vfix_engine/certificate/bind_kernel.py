"""Selection of the pairs that can be active in the next step, out of hundreds, compiled.

A pair's row is −n·ΔP ≤ bound, and no point of segment s moves further than m_s in one step within the joint bounds:
a row with a bound of m_s or more holds for every such step and is left out without effect on the solution.
Those joint bounds include the accelerations. The program of an emergency has wider ones (``joint_bounds``), which may
violate a row that was left out; as with every row, the certificate then refuses a motion that comes too near.
Of the remaining rows, nearly redundant ones are dropped, nearest first kept (``proximity.pairs.select``).
A dropped row nearly equals a nearer one; where the difference matters, the certificate refuses the step.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Int32Array
from ..kernels.compiled import merged
from ..proximity.pairs import COSINE, RADIUS_MM, select
from ..virtual_fixtures.state_kernel import BODY, SEGMENT, TRIANGLE, StateViews
from ..virtual_fixtures.stopping import stopping_distance
from .constants import StepConstants
from .inputs import SLACK


@merged
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


@merged
def binding_slack(constants: StepConstants, state: StateViews, slack: Array) -> None:
    """Write for each segment the slack (S,) to a buffered margin from which on its pairs cannot be active."""
    largest_moves(state.box, state.position, state.jacobian, state.start, state.end, slack)
    for s in range(len(slack)):
        slack[s] = stopping_distance(slack[s], constants.change)


@merged
def binding(
    constants: StepConstants, slack: Array, rows: Array, labels: Int32Array, order: Int32Array, found: int, pairs: Array
) -> int:
    """Write the pairs that can be active, at least one, by increasing distance to their margin; return their number.

    The nearest of all pairs is always the first: if it cannot be active but a pair of a faster segment can, both are
    written.

    Args:
        slack: (S,) see ``binding_slack``; rows, labels, order: the ``found`` pairs of ``measure``, see ``Inputs``.
        pairs: (MAX_ROWS, 13) out, see ``state_kernel``.
    """
    nearest = 0
    for i in range(found):
        rows[i, SLACK] = rows[i, 0] - constants.buffered_margin[labels[i, 2]]
        if rows[i, SLACK] < rows[nearest, SLACK]:
            nearest = i
    left = 0
    for i in range(found):
        if i == nearest or rows[i, SLACK] < slack[labels[i, 0]]:
            order[left] = i
            left += 1
    kept = order[len(rows) :]
    count = select(rows, labels, SLACK, order, left, COSINE, RADIUS_MM, kept)
    for i in range(count):
        source = kept[i]
        for k in range(10):
            pairs[i, k] = rows[source, k]
        pairs[i, SEGMENT], pairs[i, TRIANGLE], pairs[i, BODY] = labels[source, 0], labels[source, 1], labels[source, 2]
    return count
