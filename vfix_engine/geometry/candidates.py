"""The triangles that can matter for a while: exact queries for the control loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .capsules import Segments
from .compiled import compiled
from .pairs import Pairs, pairs_from_rows
from .rows_kernel import fits, widened, write_row
from .triangle_kernels import segment_point, segment_triangle

Array = NDArray[np.float64]
Index = NDArray[np.int32]


class CandidateList:
    """Triangles within ``reach`` mm of each segment's surface in one pose of the tool.

    Answers are exact among these triangles; ``valid_for`` tells whether they are exact for the whole mesh.
    """

    def __init__(
        self, segments: Segments, reach: float, offset: Index, triangle: Index,
        corners: Array, spheres: Array, normals: Array,
    ):  # fmt: skip
        """Segment i owns rows offset[i] to offset[i + 1] of triangle (n,), corners (n, 9), spheres (n, 4), normals."""
        self.segments, self.reach = segments, reach
        self._lists = (offset, triangle, corners, spheres, normals)

    def __len__(self) -> int:
        return len(self._lists[1])

    def valid_for(self, segments: Segments, threshold: float) -> bool:
        """Whether no triangle outside the list can be within ``threshold`` of the tool in this pose.

        A point of the axis moves no further than the ends of its segment do, and distance changes no faster than the
        point moves; a thicker capsule comes nearer by the growth of its radius.
        """
        built = self.segments
        return len(segments) == len(built) and _still_valid(
            built.start, built.end, built.radius, segments.start, segments.end, segments.radius, self.reach - threshold
        )

    def pairs_within(self, segments: Segments, threshold: float) -> Pairs:
        """All pairs whose distance is at most ``threshold`` mm, segment by segment."""
        rows, labels = _pairs(*self._lists, segments.start, segments.end, segments.radius, threshold)
        return pairs_from_rows(rows, labels)

    def min_distance_per_segment(self, segments: Segments) -> Array:
        """Smallest distance (S,) from each segment's surface to the anatomy; infinity where nothing is in reach."""
        return _least(*self._lists[:1], *self._lists[2:4], segments.start, segments.end, segments.radius)

    def clearance(self, segments: Segments) -> float:
        """Smallest distance from the whole tool's surface to the anatomy; infinity when nothing is in reach."""
        return _least_of_all(*self._lists[:1], *self._lists[2:4], segments.start, segments.end, segments.radius)


@compiled
def _still_valid(
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
    offset: Index, triangle: Index, corners: Array, spheres: Array, normals: Array,
    start: Array, end: Array, radius: Array, threshold: float,
) -> tuple[Array, Index]:  # fmt: skip
    rows, labels = np.empty((512, 10)), np.empty((512, 2), np.int32)
    found = 0
    for s in range(len(radius)):
        p, d = start[s], end[s] - start[s]
        dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        limit = threshold + radius[s]
        if limit < 0.0:
            continue
        for place in range(offset[s], offset[s + 1]):
            if fits(p, d, dd, spheres[place], limit):
                if found == len(rows):
                    rows, labels = widened(rows, labels)
                if write_row(p, d, radius[s], limit, corners[place], normals[place], rows[found]):
                    labels[found, 0], labels[found, 1] = s, triangle[place]
                    found += 1
    return rows[:found].copy(), labels[:found].copy()


@compiled
def _nearest_of(first: int, last: int, corners: Array, spheres: Array, p: Array, d: Array, bound: float) -> float:
    """Distance from the axis to the nearest of the triangles first … last − 1, or ``bound`` when none is nearer."""
    dd = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    best = bound
    # The triangle with the nearest sphere first: its distance rejects most of the others unseen.
    gaps = np.empty(last - first)
    seed, least = -1, np.inf
    for place in range(first, last):
        sphere = spheres[place]
        gap = np.sqrt(segment_point(p[0], p[1], p[2], d[0], d[1], d[2], dd, sphere[0], sphere[1], sphere[2]))
        gaps[place - first] = gap - sphere[3]
        if gap < least:
            seed, least = place, gap
    for turn in range(first - 1, last):
        place = seed if turn < first else turn
        if place < 0 or gaps[place - first] > best or (turn == seed):
            continue
        c = corners[place]
        near = segment_triangle(
            p[0], p[1], p[2], d[0], d[1], d[2], c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
        )[0]
        if near < best * best:
            best = np.sqrt(near)
    return best


@compiled
def _least(offset: Index, corners: Array, spheres: Array, start: Array, end: Array, radius: Array) -> Array:
    least = np.empty(len(radius))
    for s in range(len(radius)):
        d = end[s] - start[s]
        least[s] = _nearest_of(offset[s], offset[s + 1], corners, spheres, start[s], d, np.inf) - radius[s]
    return least


@compiled
def _least_of_all(offset: Index, corners: Array, spheres: Array, start: Array, end: Array, radius: Array) -> float:
    least = np.inf
    for s in range(len(radius)):
        d = end[s] - start[s]
        bound = least + radius[s]
        if bound > 0.0:
            least = min(least, _nearest_of(offset[s], offset[s + 1], corners, spheres, start[s], d, bound) - radius[s])
    return least
