"""Deviation of a snake's links from a pathway, compiled: Kwok 2013, eq. 8-9, for loops that make thousands of queries.

Each vertex is measured as in ``section.py`` or shown to be irrelevant: d_l of eq. 9 is a maximum of minima, so a ball
of vertices that cannot deviate more than an already measured vertex is skipped, and so is a segment that is farther
than an already measured one. Nothing here allocates an array.
A vertex with a NaN coordinate has an infinite deviation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, IntArray
from ...kernels.compiled import compiled, no_refcount
from ..packed import PackedPathway
from .query_blocks import VertexBlocks
from .query_simd import AT, GAP
from .query_tree import containing, deepest, every_of_block, take_frame
from .section import section_distance


class Deviations(NamedTuple):
    """Result of eq. 9 for L links, or (K, L) for K poses."""

    depth: Array
    """(…, L) d_l in mm, 0 if the whole link is inside."""
    vertex: IntArray
    """(…, L) row in ``LinkVertices.points`` of a vertex with that deviation; the link's first if it is 0."""
    segment: IntArray
    """(…, L) segment at which this vertex has its minimum of eq. 8."""


@no_refcount
def pose_deviations(
    packed: PackedPathway, blocks: VertexBlocks, window: IntArray, frames: Array, row: int, found: Deviations,
    into: int, work: Array,
) -> None:  # fmt: skip
    """``link_deviations`` of the pose whose links start at ``frames[row]``; results start at index ``into``."""
    near = (window[0, 0] + window[0, 1]) // 2
    for link in range(len(blocks.start) - 1):
        first, last = window[link, 0], window[link, 1]
        gap, block, lane, j = np.inf, blocks.start[link], 0, first
        if take_frame(frames, row + link, work):
            gap, block, lane, j = deepest(packed, blocks, link, near, first, last, 0.0, False, work)
            if block < 0:  # the whole link is inside
                block, lane = blocks.start[link], 0
                j = containing(packed, blocks.lanes, block, near, first, last, work)
            near = j
        found.depth[into + link], found.vertex[into + link] = gap, blocks.index[block, lane]
        found.segment[into + link] = j


@compiled
def link_deviations(
    packed: PackedPathway, blocks: VertexBlocks, window: IntArray, frames: Array, found: Deviations, work: Array
) -> None:
    """Write d_l of eq. 9 of every link into ``found``, whose arrays are (L,).

    ``window`` (L, 2): link l is measured against the segments window[l, 0] … window[l, 1] - 1; at least one, which is
    not checked. ``frames`` (L, 3, 4): links in the patient frame, [R | p] in mm. ``work`` (WORK,): scratch.
    """
    pose_deviations(packed, blocks, window, frames, 0, found, 0, work)


@compiled
def checked_deviations(
    rows: Array, polar: Array, lanes: Array, ball: Array, start: IntArray, index: IntArray,
    window: IntArray, frames: Array, depth: Array, vertex: IntArray, segment: IntArray, work: Array,
) -> int:  # fmt: skip
    """The same for K poses from Python: frames (K, L or with the base L + 1, 3 or 4, 4), results (K · L,).

    Returns 0, or 1 + the link whose window is empty or beyond the pathway, or -1 if a frame is not finite. The arrays
    are separate arguments, because tuples of them cost Python 1.5 µs more.
    """
    packed, blocks = PackedPathway(rows, polar), VertexBlocks(lanes, ball, start, index)
    found = Deviations(depth, vertex, segment)
    poses, given, links = frames.shape[0], frames.shape[1], len(start) - 1
    for link in range(links):
        if not 0 <= window[link, 0] < window[link, 1] <= len(rows):
            return 1 + link
    flat = frames.reshape(poses * given, frames.shape[2], 4)
    for k in range(poses):
        pose_deviations(packed, blocks, window, flat, (k + 1) * given - links, found, k * links, work)
    for k in range(poses * links):
        if depth[k] == np.inf:
            return -1
    return 0


@compiled
def largest_excess(
    packed: PackedPathway, blocks: VertexBlocks, window: IntArray, frames: Array, bound: Array, once: bool, work: Array
) -> float:
    """Largest d_l - b_l of all links, ``bound`` (L,) in mm: at most 0 if all satisfy d_l ≤ b_l of eq. 17.

    With ``once`` any positive one is returned, if there is one. The last link is measured first: it moves the most.
    What cannot deviate by more than its bound plus the present excess is skipped. Infinite if a frame or a bound is not
    a number.
    """
    links = len(blocks.start) - 1
    near = (window[links - 1, 0] + window[links - 1, 1]) // 2
    excess = -np.inf
    for link in range(links):
        excess = max(excess, -bound[link])  # no deviation is below 0
    for link in range(links - 1, -1, -1):
        if not (bound[link] >= 0.0 and take_frame(frames, link, work)):
            return np.inf
        if bound[link] < np.inf:
            least = max(bound[link] + excess, 0.0)
            gap, block, _, near = deepest(
                packed, blocks, link, near, window[link, 0], window[link, 1], least, once and excess > 0.0, work
            )
            excess = max(excess, gap - bound[link]) if block >= 0 else excess
            if once and excess > 0.0:
                return excess
    return excess


@compiled
def every_deviation(
    packed: PackedPathway,
    blocks: VertexBlocks,
    window: IntArray,
    frames: Array,
    gap: Array,
    segment: IntArray,
    work: Array,
) -> None:
    """Write δ_i of eq. 8 of every vertex: ``gap`` (V,) in mm and its ``segment`` (V,); one pose."""
    near = (window[0, 0] + window[0, 1]) // 2
    for link in range(len(blocks.start) - 1):
        known = take_frame(frames, link, work)
        for block in range(blocks.start[link], blocks.start[link + 1]):
            near = every_of_block(packed, blocks.lanes, block, near, window[link, 0], window[link, 1], work)
            for lane in range(16):
                i = blocks.index[block, lane]
                gap[i], segment[i] = work[GAP + lane] if known else np.inf, int(work[AT + lane])


@compiled
def points_deviation(
    rows: Array, polar: Array, first: int, last: int, points: Array, gap: Array, segment: IntArray
) -> None:
    """Write δ_i of eq. 8 of points (n, 3), segment by segment: ``gap`` (n,) in mm, ``segment`` (n,)."""
    for i in range(len(points)):
        gap[i], segment[i] = np.inf, first
        for j in range(first, last):
            signed = section_distance(points[i, 0], points[i, 1], points[i, 2], rows, polar, j)[0]
            if max(signed, 0.0) < gap[i]:
                gap[i], segment[i] = max(signed, 0.0), j
