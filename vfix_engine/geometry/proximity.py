"""Proximity between tool and anatomy: one protocol, two structures that give the same answers.

Distances are from the surface of the tool's capsules to the triangles, in mm; they are exact.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .candidate_kernels import pack
from .candidates import CandidateList
from .capsules import Segments
from .covariance.tree import CovarianceTree
from .mesh import TriangleMesh
from .pairs import Pair, Pairs, cut_made, pair_from_row, pairs_from_made, reduce_pairs
from .points import checked_points
from .wide_build import build_wide
from .wide_nearest import wide_clearance, wide_closest, wide_points
from .wide_pairs import wide_pairs

__all__ = [
    "CandidateList", "CovarianceTree", "Pair", "Pairs", "Proximity", "ProximityTree", "reduce_pairs",
]  # fmt: skip

Array = NDArray[np.float64]
Index = NDArray[np.int32]

_FIRST_CAPACITY = 256  # pairs that a first query can return without a second pass


class Proximity(Protocol):
    """What is near a tool, or a point, among the triangles of one mesh."""

    @property
    def mesh(self) -> TriangleMesh:
        """The anatomy; triangles without area count as the segment or point that they are."""
        ...

    def pairs_within(self, segments: Segments, threshold: float) -> Pairs:
        """All pairs of a segment and a triangle whose distance is at most ``threshold`` mm."""
        ...

    def clearance(self, segments: Segments, upper: float = np.inf) -> float:
        """Smallest distance from the whole tool's surface to the mesh, or ``upper`` when nothing is nearer than that.

        Where an axis touches the mesh this is minus that segment's radius, however deep the tool is.
        """
        ...

    def closest(self, segments: Segments) -> Pair:
        """The pair of the smallest distance."""
        ...

    def point_distance(self, points: ArrayLike) -> tuple[Array, Array, Index]:
        """Distance (n,), closest point (n, 3) and its triangle (n,) for points (n, 3).

        Raises:
            InputError: points that are not finite or not of that shape.
        """
        ...

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """The triangles within ``reach`` mm of each segment's surface, for exact queries around this pose."""
        ...


class ProximityTree:
    """The default: a tree of boxes, 16 at a time, over blocks of 16 triangles, 16 at a time.

    Args:
        mesh: the anatomy; triangles without area are allowed and count as the segment or point that they are.
    """

    def __init__(self, mesh: TriangleMesh):
        self._place(mesh, None)

    def _place(self, mesh: TriangleMesh, order: Index | None) -> None:
        self.mesh = mesh
        self.arrays = wide = build_wide(mesh.vertices, mesh.faces, order)
        self._capacity = _FIRST_CAPACITY
        self._store = wide.store

    def moved(self, mesh: TriangleMesh) -> ProximityTree:
        """The tree over the same faces with other vertices: without sorting, so in about half the time of a new one.

        Answers are exact whatever the motion; they stay fast while neighbours stay neighbours.

        Raises:
            InputError: another number of faces.
        """
        order = self.arrays.label[: len(self.mesh.faces)]
        if len(mesh.faces) != len(order):
            raise InputError(f"the tree has {len(order)} faces and the moved mesh {len(mesh.faces)}")
        tree = object.__new__(ProximityTree)
        tree._place(mesh, order)
        return tree

    @property
    def nbytes(self) -> int:
        """Memory of the tree itself in bytes."""
        return self._store.nbytes

    def pairs_within(self, segments: Segments, threshold: float) -> Pairs:
        """See ``Proximity.pairs_within``."""
        capacity = self._capacity
        made, found = wide_pairs(self._store, segments.packed, threshold, capacity)
        if 5 * found > 4 * capacity:  # the next query is likely to find as many; too little is only slower
            self._capacity = 2 * found
        return pairs_from_made(made, found)

    def clearance(self, segments: Segments, upper: float = np.inf) -> float:
        """See ``Proximity.clearance``."""
        return wide_clearance(self._store, segments.packed, upper)

    def closest(self, segments: Segments) -> Pair:
        """The pair of the smallest distance."""
        return pair_from_row(*wide_closest(self._store, segments.packed))

    def point_distance(self, points: ArrayLike) -> tuple[Array, Array, Index]:
        """See ``Proximity.point_distance``."""
        return wide_points(self._store, checked_points(points))

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """See ``Proximity.candidates``."""
        made, found = wide_pairs(self._store, segments.packed, reach, 2 * self._capacity)
        labels = cut_made(made, found)[1]
        store = pack(self.mesh.vertices, self.mesh.faces, labels, len(segments), self.arrays.frame)
        return CandidateList(segments, reach, store, found)
