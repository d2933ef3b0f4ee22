"""Deviation of a snake's links from a pathway, compiled: Kwok 2013, eq. 8-9, for loops that make thousands of queries.

Each vertex is measured as in ``section.py`` or shown to be of no account: d_l of eq. 9 is the largest of
the smallest, so a plate of vertices that cannot deviate more than one vertex does is left out whole, and a segment
that is farther than another one has been found is not asked. Nothing here makes an array.
A vertex whose place is no number deviates infinitely.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.compiled import borrowing, compiled
from .query_blocks import VertexBlocks, vertex_blocks
from .query_lanes import AT, GAP
from .query_tree import containing, deepest, every_of_block, take_frame
from .section import section_distance

__all__ = ["VertexBlocks", "deviations_batch", "link_deviations", "vertex_blocks", "within_bounds"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@borrowing
def pose_deviations(
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
    row: int,
    into: int,
) -> None:
    """``link_deviations`` of the pose whose links are ``frames[row]`` and on, into the numbers ``into`` and on."""
    near = (window[0, 0] + window[0, 1]) // 2
    for link in range(len(start) - 1):
        first, last = window[link, 0], window[link, 1]
        gap, block, lane, j = np.inf, start[link], 0, first
        if take_frame(frames, row + link, work):
            gap, block, lane, j = deepest(rows, polar, lanes, ball, link, near, first, last, 0.0, False, work)
            if block < 0:  # all of it is inside
                block, lane = start[link], 0
                j = containing(rows, polar, lanes, block, near, first, last, work)
            near = j
        depth[into + link], vertex[into + link], segment[into + link] = gap, index[block, lane], j


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
    pose_deviations(rows, polar, window, frames, lanes, ball, start, index, depth, vertex, segment, work, 0, 0)


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
    poses, links = frames.shape[0], frames.shape[1]
    flat, d, v, s = frames.reshape(poses * links, 3, 4), depth.reshape(-1), vertex.reshape(-1), segment.reshape(-1)
    for k in range(poses):
        pose_deviations(rows, polar, window, flat, lanes, ball, start, index, d, v, s, work, k * links, k * links)


@compiled
def checked_deviations(
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
) -> int:
    """As ``deviations_batch`` for Python: frames (K, L or with the base L + 1, 3 or 4, 4), results (K · L,).

    Returns 0, or 1 + the link whose window is none, or -1 where a frame is not of numbers.
    """
    poses, given, links = frames.shape[0], frames.shape[1], len(start) - 1
    for link in range(links):
        if not 0 <= window[link, 0] < window[link, 1] <= len(rows):
            return 1 + link
    flat = frames.reshape(poses * given, frames.shape[2], 4)
    for k in range(poses):
        row, into = (k + 1) * given - links, k * links
        pose_deviations(rows, polar, window, flat, lanes, ball, start, index, depth, vertex, segment, work, row, into)
    for k in range(poses * links):
        if depth[k] == np.inf:
            return -1
    return 0


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
    """Whether no vertex of link l deviates by more than ``bound`` (L,) in mm: d_l ≤ b_l of eq. 17 for every link.

    The last link is asked first: it moves the farthest.
    """
    links = len(start) - 1
    near = (window[links - 1, 0] + window[links - 1, 1]) // 2
    for link in range(links - 1, -1, -1):
        if not (bound[link] >= 0.0 and take_frame(frames, link, work)):
            return False
        first, last, limit = window[link, 0], window[link, 1], bound[link]
        _, block, _, near = deepest(rows, polar, lanes, ball, link, near, first, last, limit, True, work)
        if block >= 0:
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
    near = (window[0, 0] + window[0, 1]) // 2
    for link in range(len(start) - 1):
        known = take_frame(frames, link, work)
        for block in range(start[link], start[link + 1]):
            near = every_of_block(rows, polar, lanes, block, near, window[link, 0], window[link, 1], work)
            for lane in range(16):
                i = index[block, lane]
                gap[i], segment[i] = work[GAP + lane] if known else np.inf, int(work[AT + lane])


@compiled
def points_deviation(
    rows: Array, polar: Array, first: int, last: int, points: Array, gap: Array, segment: Index
) -> None:
    """δ_i of eq. 8 of points (n, 3), segment by segment: ``gap`` (n,) in mm, ``segment`` (n,)."""
    for i in range(len(points)):
        gap[i], segment[i] = np.inf, first
        for j in range(first, last):
            signed = section_distance(points[i, 0], points[i, 1], points[i, 2], rows, polar, j)[0]
            if max(signed, 0.0) < gap[i]:
                gap[i], segment[i] = max(signed, 0.0), j
