"""Deviation of a snake's links from a pathway, compiled: Kwok 2013, eq. 8-9, for loops that make thousands of queries.

Nothing here makes an array. A vertex whose place is no number deviates infinitely.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, compiled
from .query_blocks import VertexBlocks, vertex_blocks
from .section import section_distance

__all__ = ["VertexBlocks", "deviations_batch", "link_deviations", "vertex_blocks", "within_bounds"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@borrowing
def point_deviation(
    x: float, y: float, z: float, rows: Array, polar: Array, first: int, last: int
) -> tuple[float, int]:
    """δ_i of eq. 8 of one point over the segments ``first`` … ``last`` - 1, and the segment that has it."""
    least, where = np.inf, first
    for j in range(first, last):
        signed = section_distance(x, y, z, rows, polar, j)[0]
        gap = 0.0 if signed <= 0.0 else signed
        if gap < least:
            least, where = gap, j
    return least, where


@borrowing
def place(frames: Array, link: int, lanes: Array, block: int, lane: int) -> tuple[float, float, float]:
    """A block's point in the patient frame."""
    a, b, c = lanes[block, lane], lanes[block, 16 + lane], lanes[block, 32 + lane]
    x = frames[link, 0, 0] * a + frames[link, 0, 1] * b + frames[link, 0, 2] * c + frames[link, 0, 3]
    y = frames[link, 1, 0] * a + frames[link, 1, 1] * b + frames[link, 1, 2] * c + frames[link, 1, 3]
    z = frames[link, 2, 0] * a + frames[link, 2, 1] * b + frames[link, 2, 2] * c + frames[link, 2, 3]
    return x, y, z


@compiled
def link_deviations(
    rows: Array,
    polar: Array,
    window: Index,
    frames: Array,
    lanes: Array,
    ball: Array,
    start: Index,
    index: Index,
    depth: Array,
    vertex: Index,
    segment: Index,
    work: Array,
) -> None:
    """d_l of eq. 9 of every link: ``depth`` (L,) in mm, the ``vertex`` that has it and that vertex's ``segment``.

    ``rows``, ``polar``: of a ``PackedPathway``. ``window`` (L, 2): link l is asked against the segments
    window[l, 0] … window[l, 1] - 1; at least one, which is not checked. ``frames`` (L, 3, 4): links in the patient
    frame, [R | p] in mm. ``lanes``, ``ball``, ``start``, ``index``: of ``VertexBlocks``. ``work`` (256,): scratch.
    """
    for link in range(len(start) - 1):
        deepest, culprit, at = -1.0, index[start[link], 0], window[link, 0]
        for block in range(start[link], start[link + 1]):
            for lane in range(16):
                x, y, z = place(frames, link, lanes, block, lane)
                gap, j = point_deviation(x, y, z, rows, polar, window[link, 0], window[link, 1])
                if gap > deepest:
                    deepest, culprit, at = gap, index[block, lane], j
        depth[link], vertex[link], segment[link] = deepest, culprit, at


@compiled
def deviations_batch(
    rows: Array,
    polar: Array,
    window: Index,
    frames: Array,
    lanes: Array,
    ball: Array,
    start: Index,
    index: Index,
    depth: Array,
    vertex: Index,
    segment: Index,
    work: Array,
) -> None:
    """``link_deviations`` of K poses: ``frames`` (K, L, 3, 4); ``depth``, ``vertex`` and ``segment`` are (K, L)."""
    for k in range(len(frames)):
        link_deviations(
            rows, polar, window, frames[k], lanes, ball, start, index, depth[k], vertex[k], segment[k], work
        )


@compiled
def within_bounds(
    rows: Array,
    polar: Array,
    window: Index,
    frames: Array,
    lanes: Array,
    ball: Array,
    start: Index,
    bound: Array,
    work: Array,
) -> bool:
    """Whether no vertex of link l deviates by more than ``bound`` (L,) in mm: d_l ≤ b_l of eq. 17 for every link."""
    for link in range(len(start) - 1):
        for block in range(start[link], start[link + 1]):
            for lane in range(16):
                x, y, z = place(frames, link, lanes, block, lane)
                gap, _ = point_deviation(x, y, z, rows, polar, window[link, 0], window[link, 1])
                if not gap <= bound[link]:
                    return False
    return True


@compiled
def every_deviation(
    rows: Array,
    polar: Array,
    window: Index,
    frames: Array,
    lanes: Array,
    ball: Array,
    start: Index,
    index: Index,
    gap: Array,
    segment: Index,
    work: Array,
) -> None:
    """δ_i of eq. 8 of every vertex: ``gap`` (V,) in mm and the ``segment`` (V,) that has it; one pose."""
    for link in range(len(start) - 1):
        for block in range(start[link], start[link + 1]):
            for lane in range(16):
                x, y, z = place(frames, link, lanes, block, lane)
                i = index[block, lane]
                gap[i], segment[i] = point_deviation(x, y, z, rows, polar, window[link, 0], window[link, 1])


@compiled
def points_deviation(
    rows: Array, polar: Array, first: int, last: int, points: Array, gap: Array, segment: Index
) -> None:
    """``point_deviation`` of points (n, 3): ``gap`` (n,), ``segment`` (n,)."""
    for i in range(len(points)):
        gap[i], segment[i] = point_deviation(points[i, 0], points[i, 1], points[i, 2], rows, polar, first, last)
