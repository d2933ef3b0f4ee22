"""The step state packed into one array, which compiled code accepts and returns as a whole.

``StateViews`` is the table of its fields, for Python and compiled code.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from ..arrays import Array
from ..kernels.packed import packing
from ..proximity.pairs import MAX_ROWS

PAIR = 13  # columns of a pair: the ten of ``geometry.rows_kernel``, then segment, triangle and obstacle
SEGMENT, TRIANGLE, BODY = 10, 11, 12
PAIR_COUNT, BROKEN_COUNT = 0, 1


class StateViews(NamedTuple):
    """A packed step state; n joints, S segments, B obstacles; patient frame, mm and rad.

    q, velocity: (n,) joints and joint velocity.
    position (3,), rotation (3, 3), jacobian (6, n): of the tip.
    start, end: (S, 3) of the tool's axis segments.
    distance: (B, S) from every obstacle to the surface of every segment.
    box: (2, n) lower and upper bounds of Δq in the next step, see ``joint_limits.step_box``.
    counts: number of pairs that can be active in the next step; number of joints that must exceed their acceleration
        limit.
    pairs: capacity for ``MAX_ROWS`` pairs, nearest to their margin first.
    """

    q: Annotated[Array, "n"]
    velocity: Annotated[Array, "n"]
    position: Annotated[Array, 3]
    rotation: Annotated[Array, 3, 3]
    jacobian: Annotated[Array, 6, "n"]
    start: Annotated[Array, "s", 3]
    end: Annotated[Array, "s", 3]
    distance: Annotated[Array, "b", "s"]
    box: Annotated[Array, 2, "n"]
    counts: Annotated[Array, 2]
    pairs: Annotated[Array, MAX_ROWS, PAIR]


STATE = packing(StateViews, "n", "s", "b")
state_views, state_size = STATE.views, STATE.size
