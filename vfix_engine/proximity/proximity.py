"""Proximity queries between tool and anatomy: one protocol, two implementations with the same results.

Distances are from the surface of the tool's capsules to the triangles, in mm; they are exact.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, Int32Array
from ..errors import InputError
from ..geometry.capsules import Segments
from ..geometry.checks import checked_points
from ..geometry.mesh import TriangleMesh
from .bvh16_build import build_bvh16
from .bvh16_nearest import bvh16_clearance, bvh16_closest, bvh16_points
from .bvh16_pairs import bvh16_pairs
from .candidate_kernels import pack
from .candidates import CandidateList
from .covariance.tree import CovarianceTree
from .pairs import Pair, Pairs, pair_from_row, pairs_from_buffer, reduce_pairs, rows_and_labels

__all__ = [
    "CandidateList", "CovarianceTree", "Pair", "Pairs", "Proximity", "ProximityTree", "reduce_pairs",
]  # fmt: skip


_FIRST_CAPACITY = 256  # initial number of pairs in a query's buffer


class Proximity(Protocol):
    """Proximity queries of a tool or of points against one mesh; lengths in mm, patient frame."""

    @property
    def mesh(self) -> TriangleMesh:
        """The anatomy; triangles without area count as segments or points."""
        ...

    def pairs_within(self, segments: Segments, threshold: float) -> Pairs:
        """All pairs of a segment and a triangle whose distance is at most ``threshold`` mm.

        Raises:
            InputError: the threshold is NaN.
        """
        ...

    def clearance(self, segments: Segments, upper: float = np.inf) -> float:
        """Smallest distance from the whole tool's surface to the mesh, or ``upper`` if no triangle is nearer than that.

        Where an axis intersects the mesh this is minus the segment's radius, independent of the depth.
        """
        ...

    def closest(self, segments: Segments) -> Pair:
        """Return the pair with the smallest distance."""
        ...

    def point_distance(self, points: ArrayLike) -> tuple[Array, Array, Int32Array]:
        """Distance (n,), closest point (n, 3) and its triangle (n,) for points (n, 3).

        Raises:
            InputError: points that are not finite or not of that shape.
        """
        ...

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """The triangles within ``reach`` mm of each segment's surface, for exact queries around this pose."""
        ...


class ProximityTree:
    """The default implementation of ``Proximity``: a 16-wide bounding volume hierarchy over blocks of 16 triangles.

    Args:
        mesh: the anatomy; triangles without area count as segments or points.
    """

    def __init__(self, mesh: TriangleMesh):
        self._place(mesh, None)

    def _place(self, mesh: TriangleMesh, order: Int32Array | None) -> None:
        self.mesh = mesh
        self.arrays = wide = build_bvh16(mesh.vertices, mesh.faces, order)
        self._capacity = _FIRST_CAPACITY
        self._store = wide.store

    def moved(self, mesh: TriangleMesh) -> ProximityTree:
        """Refit the tree to the same faces with moved vertices, about four times as fast as building a new one.

        The order of the triangles is kept. Results are exact for any motion, and fast while neighbours stay close.

        Raises:
            InputError: the mesh has another number of faces.
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
        if threshold != threshold:  # every comparison with NaN is false, so no pair would be found
            raise InputError("the threshold of a query is NaN; it is a distance in mm")
        capacity = self._capacity
        buffer, found = bvh16_pairs(self._store, segments.packed, threshold, capacity)
        if 5 * found > 4 * capacity:  # the next query is likely to find as many; a buffer too small only costs time
            self._capacity = 2 * found
        return pairs_from_buffer(buffer, found)

    def clearance(self, segments: Segments, upper: float = np.inf) -> float:
        """See ``Proximity.clearance``."""
        return bvh16_clearance(self._store, segments.packed, upper)

    def closest(self, segments: Segments) -> Pair:
        """See ``Proximity.closest``."""
        return pair_from_row(*bvh16_closest(self._store, segments.packed))

    def point_distance(self, points: ArrayLike) -> tuple[Array, Array, Int32Array]:
        """See ``Proximity.point_distance``."""
        return bvh16_points(self._store, checked_points(points))

    def candidates(self, segments: Segments, reach: float) -> CandidateList:
        """See ``Proximity.candidates``."""
        buffer, found = bvh16_pairs(self._store, segments.packed, reach, 2 * self._capacity)
        labels = rows_and_labels(buffer, found)[1]
        store = pack(self.mesh.vertices, self.mesh.faces, labels, len(segments), self.arrays.frame)
        return CandidateList(segments, reach, store, found)
