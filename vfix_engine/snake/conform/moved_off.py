"""A planned shape is moved off the wall before it is followed.

Conformance knows joints and a curve and no bounds. A shape that comes nearer to a bound than a reserve is moved off it
while it is planned, and those after it go on from there; so it is not left to the moment in which the robot is there
and one step of its joints would have to do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array, IntArray
from ...pathway.packed import PackedPathway
from ...pathway.query.query import Query
from ...robots.snake import SnakeModel
from ..control.projection import projected_to_limits
from ..control.tip_control import DistalContext
from .conformance import ShapeSolution

RESERVE_MM = 0.1  # [mm] so much inside of its bound a link is planned to be, half its bound at most
MOST = 0.1  # [rad] that a joint of a planned shape may be moved for it


def moved_off(
    shape: ShapeSolution,
    snake: SnakeModel,
    query: Query,
    packed: PackedPathway,
    windows: IntArray,
    bound: Array,
    bend: Array | None = None,
) -> ShapeSolution | None:
    """A shape that keeps its bounds (L,) mm, near one that does not or hardly; None where it does, or none is found.

    windows: (L, 2) segments that the links are measured against. bend: (2L,) rad, of the joints off the shape that
        keeps the bounds with it; None: none.
    """
    kept = bound - np.minimum(RESERVE_MM, 0.5 * bound)
    bent = shape.q if bend is None or not bend.any() else snake.clamp(shape.q + bend)
    depth = query.deviations(packed, snake.frames(bent, shape.base), windows).depth
    if (depth <= kept).all():
        return None
    q = projected_to_limits(DistalContext(snake, query, shape.base, bent, packed, windows, kept), bent, MOST)
    if q is None or (query.deviations(packed, snake.frames(q, shape.base), windows).depth > bound).any():
        return None
    return replace(shape, q=q if bent is shape.q else snake.clamp(shape.q + (q - bent)), exact=False)
