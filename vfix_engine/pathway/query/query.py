"""Deviation of a snake from its constraint pathway, Kwok 2013, eq. 8-9: the Python interface of the query."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, IntArray
from ...errors import InputError
from ..packed import PackedPathway, check_packed
from .query_blocks import VertexBlocks, vertex_blocks
from .query_fast import Deviations as Deviations
from .query_fast import checked_deviations, every_deviation, points_deviation
from .query_simd import WORK
from .query_tree import FARTHEST

if TYPE_CHECKING:  # the query does not depend on the robots' libraries at run time
    from ...robots.snake_surface import LinkVertices


_FRAMES = (3, 4), (4, 4)
_PAIRS = 64


class Query:
    """Queries one snake's vertices for any pathway, any pose and any window of segments."""

    def __init__(self, snake_vertices: LinkVertices) -> None:
        """Raises InputError if a link has no vertices or a vertex is not finite."""
        self.vertices = snake_vertices
        self.blocks: VertexBlocks = vertex_blocks(snake_vertices)
        self.links = len(snake_vertices.start) - 1
        self._work = np.zeros(WORK)
        self._known: PackedPathway | None = None  # the last validated pathway, if it is read-only
        self._pairs: dict[object, IntArray] = {}  # windows (L, 2) of pairs, which control uses repeatedly

    def deviations(self, packed: PackedPathway, frames: ArrayLike, windows: ArrayLike | tuple[int, int]) -> Deviations:
        """Deviation d_l of each link in mm (Kwok 2013, eq. 9), with the vertex and the segment that cause it.

        Args:
            packed: the pathway, patient frame, mm; validated once, or every time if it is writable.
            frames: [R | p] of the links in the patient frame: (L, 3, 4), (L, 4, 4) or (L + 1, 4, 4) with the base
                first, as ``SnakeModel.frames`` returns, or K such poses.
            windows: segments first … last - 1 against which a link is measured: one pair for all or (L, 2).

        Raises:
            InputError: frames or windows of another shape, frames that are not finite, empty windows; an invalid
                pathway.
        """
        self.check(packed)
        poses, window = self._poses(frames), self._windows(windows)
        count = len(poses) * self.links
        found = Deviations(np.empty(count), np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64))
        blocks = self.blocks
        wrong = checked_deviations(
            packed.rows, packed.polar, blocks.lanes, blocks.ball, blocks.start, blocks.index, window, poses,
            found.depth, found.vertex, found.segment, self._work,
        )  # fmt: skip
        if wrong < 0:
            raise InputError("frames are not finite: give finite transforms")
        if wrong > 0:
            _check_windows(window, len(packed.rows))
        if np.ndim(frames) == 4:
            shape = len(poses), self.links
            return Deviations(found.depth.reshape(shape), found.vertex.reshape(shape), found.segment.reshape(shape))
        return found

    def every_vertex(
        self, packed: PackedPathway, frames: ArrayLike, windows: ArrayLike | tuple[int, int]
    ) -> tuple[Array, IntArray]:
        """δ_i of every vertex (V,) in mm (Kwok 2013, eq. 8) and the segment (V,) that determines it; one pose.

        Raises:
            InputError: see ``deviations``.
        """
        poses, window = self.checked(packed, frames, windows)
        gap = np.empty(len(self.vertices.points))
        segment = np.empty(len(gap), dtype=np.int64)
        every_deviation(packed, self.blocks, window, poses[0], gap, segment, self._work)
        return gap, segment

    def checked(
        self, packed: PackedPathway, frames: ArrayLike, windows: ArrayLike | tuple[int, int]
    ) -> tuple[Array, IntArray]:
        """Frames as (K, L, 3, 4) and windows as (L, 2), contiguous; InputError as in ``deviations``."""
        self.check(packed)
        poses, window = self._poses(frames), self._windows(windows)
        taken = np.ascontiguousarray(poses[:, -self.links :, :3])
        with np.errstate(over="ignore"):
            far = not (np.abs(taken).sum(axis=(2, 3)) < FARTHEST).all()  # also for NaN
        if far:
            raise InputError("frames are not finite: give finite transforms")
        _check_windows(window, len(packed.rows))
        return taken, window

    def check(self, packed: PackedPathway) -> None:
        """Raise InputError unless it is a valid pathway."""
        if packed is self._known:
            return
        check_packed(packed)
        fixed = not (packed.rows.flags.writeable or packed.polar.flags.writeable)
        self._known = packed if fixed else None

    def _poses(self, frames: ArrayLike) -> Array:
        """Frames as (K, L, 3, 4), with the base and the fourth row removed."""
        poses = np.array(frames, dtype=np.float64, order="C")
        if poses.ndim == 3:
            poses = poses[None]
        if poses.ndim != 4 or poses.shape[2:] not in _FRAMES:
            raise InputError(f"frames are (L, 3, 4) or (L + 1, 4, 4) or poses of them, not {np.shape(frames)}")
        if poses.shape[1] - self.links not in (0, 1):
            raise InputError(f"frames of {poses.shape[1]} links for a snake of {self.links}")
        return poses

    def _windows(self, windows: ArrayLike | tuple[int, int]) -> IntArray:
        """Windows as (L, 2)."""
        pair = tuple(windows) if isinstance(windows, tuple) and [type(one) for one in windows] == [int, int] else None
        if pair in self._pairs:
            return self._pairs[pair]
        given = np.array(windows)
        if given.shape not in ((2,), (self.links, 2)) or given.dtype.kind not in "iu":
            raise InputError(f"windows are one pair of segment numbers or ({self.links}, 2), not {given.shape}")
        if given.ndim == 2:
            return np.ascontiguousarray(given, dtype=np.int64)
        window = np.ascontiguousarray(np.broadcast_to(given, (self.links, 2)), dtype=np.int64)
        if pair is not None:
            if len(self._pairs) >= _PAIRS:
                self._pairs.clear()
            self._pairs[pair] = window
        return window


def deviation_of_points(points: ArrayLike, packed: PackedPathway, first: int, last: int) -> tuple[Array, IntArray]:
    """δ_i in mm (n,) of any points (n, 3) against the segments ``first`` … ``last`` - 1, and their segments (n,).

    Kwok 2013, eq. 1-8, segment by segment without exclusions: the reference for the fast query.

    Raises:
        InputError: points of another shape or not finite; an empty window; an invalid pathway.
    """
    check_packed(packed)
    places = np.array(points, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or not np.isfinite(places).all():
        raise InputError(f"points are finite and (n, 3) in mm, not {places.shape}")
    _check_windows(np.array([[first, last]]), len(packed.rows))
    gap = np.empty(len(places))
    segment = np.empty(len(places), dtype=np.int64)
    points_deviation(packed.rows, packed.polar, first, last, places, gap, segment)
    return gap, segment


def _check_windows(window: IntArray, segments: int) -> None:
    wrong = (window[:, 0] < 0) | (window[:, 0] >= window[:, 1]) | (window[:, 1] > segments)
    if wrong.any():
        first, last = window[int(wrong.argmax())]
        raise InputError(f"a window of segments {first} to {last}: needs 0 ≤ first < last ≤ {segments}")
