"""The covariance tree of Li 2007, section III.D, as the reference for ``ProximityTree``.

Distances are from the surface of the tool's capsules to the triangles, in mm, and exact. Grouped pairs are not: they
lie on the enlarged boxes of flat nodes, no farther than any triangle of the node.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, Int32Array
from ...errors import InputError
from ...geometry.capsules import Segments
from ...geometry.checks import checked_points
from ...geometry.mesh import TriangleMesh
from ..candidate_kernels import pack
from ..candidates import CandidateList
from ..pairs import Pair, Pairs, pair_from_row, pairs_from_rows
from ..rows_kernel import write_row
from .build import TreeNodes, build
from .query import tree_nearest, tree_pairs, tree_points
from .spheres import enclosing_spheres


class CovarianceTree:
    """Covariance tree over the triangles of one mesh.

    Args:
        mesh: the anatomy; triangles without area count as segments or points.
        leaf_size: largest number of triangles in a leaf.

    Raises:
        InputError: a leaf size below 1.
    """

    def __init__(self, mesh: TriangleMesh, leaf_size: int = 8):
        if leaf_size < 1:
            raise InputError(f"a leaf holds at least one triangle, not {leaf_size}")
        self.mesh = mesh
        centres, radii = enclosing_spheres(mesh.triangles)
        self.nodes = TreeNodes(*build(centres, radii, leaf_size))
        order = self.nodes.order
        # In the order of the leaves: neighbours in space are neighbours in memory.
        self._corners = np.ascontiguousarray(mesh.triangles[order].reshape(-1, 9))
        self._spheres = np.ascontiguousarray(np.column_stack([centres, radii])[order])
        self._normals = np.ascontiguousarray(mesh.face_normals[order])

    def pairs_within(
        self, segments: Segments, threshold: float, *, group_flat: float | None = None, exact_within: float = 1.0
    ) -> Pairs:
        """All pairs of a segment and a triangle whose distance is at most ``threshold`` mm.

        With ``group_flat``, a node gives one pair on its box instead of one per triangle if the box is no thicker than
        ``group_flat`` mm, the segment does not enter it, and it is farther than ``exact_within`` mm.
        """
        flat = -1.0 if group_flat is None else group_flat
        rows, labels = tree_pairs(
            *self.nodes, self._corners, self._spheres, self._normals,
            segments.start, segments.end, segments.radius, threshold, flat, exact_within,
        )  # fmt: skip
        return pairs_from_rows(rows, labels)

    def clearance(self, segments: Segments, upper: float = np.inf) -> float:
        """Smallest distance from the whole tool's surface to the mesh, or ``upper`` when nothing is nearer than that.

        Where an axis intersects the mesh this is minus the segment's radius, whatever the depth.
        """
        return self._nearest(segments, upper)[0]

    def closest(self, segments: Segments) -> Pair:
        """The pair of the smallest distance."""
        _, segment, place = self._nearest(segments, np.inf)
        row = np.empty(10)
        start = segments.start[segment]
        along = segments.end[segment] - start
        radius = float(segments.radius[segment])
        write_row(start, along, radius, np.inf, self._corners[place], self._normals[place], row)
        return pair_from_row(tuple(row.tolist()), segment, int(self.nodes.order[place]))

    def point_distance(self, points: ArrayLike) -> tuple[Array, Array, Int32Array]:
        """Distance (n,), closest point (n, 3) and its triangle (n,) for points (n, 3)."""
        return tree_points(*self.nodes, self._corners, self._spheres, checked_points(points))

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """The triangles within ``reach`` mm of each segment's surface, for exact queries around this pose."""
        labels = tree_pairs(
            *self.nodes, self._corners, self._spheres, self._normals,
            segments.start, segments.end, segments.radius, reach, -1.0, 0.0,
        )[1]  # fmt: skip
        low, high = self.mesh.bounds
        frame = np.array([*(0.5 * (low + high)), np.abs(high - low).max()])
        store = pack(self.mesh.vertices, self.mesh.faces, labels, len(segments), frame)
        return CandidateList(segments, reach, store, len(labels))

    def _nearest(self, segments: Segments, upper: float) -> tuple[float, int, int]:
        """Smallest distance, its segment, its place in the leaves' order; (upper, −1, −1) when none is nearer."""
        least, segment, place = upper, -1, -1
        for s in range(len(segments)):
            start, radius = segments.start[s], float(segments.radius[s])
            if least + radius <= 0.0:
                continue
            gap, found = tree_nearest(
                *self.nodes[:5], self._corners, self._spheres, start, segments.end[s] - start, least + radius
            )
            if found >= 0:
                least, segment, place = float(np.sqrt(gap)) - radius, s, found
        return least, segment, place
