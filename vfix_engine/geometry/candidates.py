"""The triangles that can matter for a while: exact queries for the control loop."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .block_kernels import LANES
from .candidate_groups import block_shells, list_groups
from .candidate_kernels import NUMBERS, SINGLES, Candidates, pairs_into, segment_least
from .capsules import Segments
from .compiled import borrowing, compiled
from .pairs import Pairs, pairs_from_rows

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Index = NDArray[np.int32]
Lanes = NDArray[np.uint64]


class CandidateList:
    """Triangles within ``reach`` mm of each segment's surface in one pose of the tool.

    Answers are exact among these triangles; ``valid_for`` tells whether they are exact for the whole mesh.

    Args:
        segments: the pose.
        reach: mm.
        arrays: the triangles, for compiled code as well.
        size: how many they are, over all segments.
    """

    def __init__(self, segments: Segments, reach: float, arrays: Candidates, size: int):
        self.segments, self.reach, self.arrays = segments, reach, arrays
        self._size = size

    def __len__(self) -> int:
        return self._size

    def valid_for(self, segments: Segments, threshold: float) -> bool:
        """Whether no triangle outside the list can be within ``threshold`` of the tool in this pose.

        A point of the axis moves no further than the ends of its segment do, and distance changes no faster than the
        point moves; a thicker capsule comes nearer by the growth of its radius.
        """
        built = self.segments
        return len(segments) == len(built) and still_valid(
            built.start, built.end, built.radius, segments.start, segments.end, segments.radius, self.reach - threshold
        )

    def pairs_within(
        self, segments: Segments, threshold: float, *, group_flat: float | None = None, exact_within: float = 1.0
    ) -> Pairs:
        """All pairs whose distance is at most ``threshold`` mm, segment by segment; grouped as in ``Proximity``."""
        tool = (segments.start, segments.end, segments.radius)
        if group_flat is None:
            return pairs_from_rows(*_pairs(*self.arrays, *tool, threshold, self._size))
        _, corners, label, frame, offset = self.arrays
        return pairs_from_rows(
            *list_groups(
                corners, label, self._shells, frame, offset, *tool, threshold, group_flat, exact_within, self._size
            )
        )

    @cached_property
    def _shells(self) -> Single:
        """Boxes of the blocks along their own axes: only grouped pairs need them."""
        return block_shells(self.arrays.corners, self.arrays.label, self.arrays.frame)

    def min_distance_per_segment(self, segments: Segments) -> Array:
        """Smallest distance (S,) from each segment's surface to the anatomy; infinity where nothing is in reach."""
        return _least(*self.arrays, segments.start, segments.end, segments.radius)

    def clearance(self, segments: Segments) -> float:
        """Smallest distance from the whole tool's surface to the anatomy; infinity when nothing is in reach."""
        return float(self.min_distance_per_segment(segments).min(initial=np.inf))


@compiled
def still_valid(
    start: Array, end: Array, radius: Array, new_start: Array, new_end: Array, new_radius: Array, slack: float
) -> bool:
    for s in range(len(radius)):
        one, two = 0.0, 0.0
        for k in range(3):
            one += (new_start[s, k] - start[s, k]) ** 2
            two += (new_end[s, k] - end[s, k]) ** 2
        # A hair less than the slack, so that rounding cannot decide.
        if not np.sqrt(max(one, two)) + max(new_radius[s] - radius[s], 0.0) <= slack - 1e-9:
            return False
    return True


@compiled
def _pairs(
    boxes: Single, corners: Array, label: Index, frame: Array, offset: Index,
    start: Array, end: Array, radius: Array, threshold: float, size: int,
) -> tuple[Array, Index]:  # fmt: skip
    rows, labels, along = np.empty((size, 10)), np.empty((size, 2), np.int32), np.empty(3)
    numbers, singles, lanes = np.empty(NUMBERS), np.empty(SINGLES, np.float32), np.empty(LANES + 1, np.uint64)
    found = _pairs_into(
        boxes, corners, label, frame, offset, start, end, radius, threshold,
        rows, labels, along, numbers, singles, lanes,
    )  # fmt: skip
    return rows[:found], labels[:found]


@borrowing
def _pairs_into(
    boxes: Single, corners: Array, label: Index, frame: Array, offset: Index,
    start: Array, end: Array, radius: Array, threshold: float,
    rows: Array, labels: Index, along: Array, numbers: Array, singles: Single, lanes: Lanes,
) -> int:  # fmt: skip
    found = 0
    for s in range(len(radius)):
        for k in range(3):
            along[k] = end[s, k] - start[s, k]
        found, _ = pairs_into(
            boxes, corners, label, frame, offset[s], offset[s + 1],
            start[s], along, radius[s], threshold, s, rows, labels, found, numbers, singles, lanes,
        )  # fmt: skip
    return found


@compiled
def _least(
    boxes: Single, corners: Array, label: Index, frame: Array, offset: Index, start: Array, end: Array, radius: Array
) -> Array:
    least = np.empty(len(radius))
    for s in range(len(radius)):
        gap = segment_least(
            boxes, corners, label, frame, offset[s], offset[s + 1], start[s], end[s] - start[s], np.inf
        )  # fmt: skip
        least[s] = gap - radius[s]
    return least
