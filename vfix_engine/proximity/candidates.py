"""Candidate list: the triangles near a tool, for exact queries of the control loop during small motions."""

from __future__ import annotations

import numpy as np

from ..arrays import Array, Float32Array, Int32Array
from ..geometry.capsules import Segments
from ..kernels.compiled import compiled, no_refcount
from .bvh16_search import WORKSPACE, rows_of, tool_of, workspace_of
from .candidate_kernels import NUMBERS, Candidates, list_views, list_views_compiled, pairs_into, segment_least
from .pairs import Pairs, pairs_from_buffer


class CandidateList:
    """Triangles within ``reach`` mm of each segment's surface in one pose of the tool.

    Results are exact among these triangles; ``valid_for`` checks whether they are exact for the whole mesh.

    Args:
        segments: the pose.
        reach: mm.
        store: buffer of ``candidate_kernels.pack``.
        size: number of triangles over all segments.
    """

    def __init__(self, segments: Segments, reach: float, store: Array, size: int):
        self.segments, self.reach = segments, reach
        self.arrays = Candidates(*list_views(store, len(segments)))
        self._store, self._size = store, size

    def __len__(self) -> int:
        return self._size

    def valid_for(self, segments: Segments, threshold: float) -> bool:
        """Whether every triangle within ``threshold`` mm of the tool in this pose is in the list.

        A point of the axis moves no further than the ends of its segment, and distance is 1-Lipschitz in the position;
        an increase of the radius is added.
        """
        built = self.segments
        return len(segments) == len(built) and still_valid(
            built.start, built.end, built.radius, segments.start, segments.end, segments.radius, self.reach - threshold
        )

    def pairs_within(self, segments: Segments, threshold: float) -> Pairs:
        """All pairs whose distance is at most ``threshold`` mm, segment by segment."""
        return pairs_from_buffer(*list_pairs(self._store, segments.packed, threshold, self._size))

    def min_distance_per_segment(self, segments: Segments) -> Array:
        """Smallest distance (S,) from each segment's surface to the anatomy; ∞ if no triangle is within reach."""
        return _least(*self.arrays, segments.start, segments.end, segments.radius)

    def clearance(self, segments: Segments) -> float:
        """Smallest distance from the whole tool's surface to the anatomy; ∞ if no triangle is within reach."""
        return float(self.min_distance_per_segment(segments).min(initial=np.inf))


@no_refcount
def still_valid(
    start: Array, end: Array, radius: Array, new_start: Array, new_end: Array, new_radius: Array, slack: float
) -> bool:
    for s in range(len(radius)):
        one, two = 0.0, 0.0
        for k in range(3):
            one += (new_start[s, k] - start[s, k]) ** 2
            two += (new_end[s, k] - end[s, k]) ** 2
        # Slightly less than the slack, as an allowance for rounding.
        if not np.sqrt(max(one, two)) + max(new_radius[s] - radius[s], 0.0) <= slack - 1e-9:
            return False
    return True


@compiled
def list_pairs(store: Array, tool: Array, threshold: float, size: int) -> tuple[Array, int]:
    """Query all pairs as ``bvh16_pairs`` does, in a candidate list of ``size`` triangles."""
    buffer = np.empty(11 * size)
    return buffer, _pairs_into(store, tool, threshold, buffer, np.empty(WORKSPACE))


@no_refcount
def _pairs_into(store: Array, tool: Array, threshold: float, buffer: Array, workspace: Array) -> int:
    start, end, radius = tool_of(tool)
    boxes, corners, label, frame, offset = list_views_compiled(store, len(radius))
    rows, labels = rows_of(buffer)
    numbers, singles, _, lanes = workspace_of(workspace)
    along = numbers[NUMBERS : NUMBERS + 3]
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
    boxes: Float32Array,
    corners: Array,
    label: Int32Array,
    frame: Array,
    offset: Int32Array,
    start: Array,
    end: Array,
    radius: Array,
) -> Array:
    least = np.empty(len(radius))
    for s in range(len(radius)):
        gap = segment_least(
            boxes, corners, label, frame, offset[s], offset[s + 1], start[s], end[s] - start[s], np.inf
        )  # fmt: skip
        least[s] = gap - radius[s]
    return least
