"""Contact of a free tool with its surroundings: distances, and the force with which bone answers a penetration.

Bone is a spring: on each side of the tool, of all pairs whose normals are within 60° of those of the deepest, it
answers with stiffness × depth at that deepest one. So a push of F against one wall ends at F / stiffness, however
many triangles and parts of the tool are in contact. Protected structures are measured but do not push back: nothing
is known of their stiffness.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, IndexArray
from ...geometry.capsules import Segments
from ...geometry.shape_kernels import shape_row
from ...geometry.shapes import shape_table
from ...proximity.proximity import Proximity
from ...virtual_fixtures import Zone
from ...virtual_fixtures.zones import ANATOMY, bodies, ordered

SIDE_COSINE = 0.5  # of two normals that belong to one side of the tool
MOST_SIDES = 6  # that push at the same time; with normals 60° apart there are hardly more


class ContactForces(NamedTuple):
    """Where bone pushes the tool in one pose. force, at: (m, 3) in N and mm; deepest: penetration over radius."""

    force: Array
    at: Array
    deepest: float


NO_CONTACT = ContactForces(np.zeros((0, 3)), np.zeros((0, 3)), 0.0)


class ContactModel:
    """What is around a free tool: the anatomy, and the protected structures in the order of ``zones.ordered``."""

    def __init__(self, tree: Proximity, zones: tuple[Zone, ...], stiffness_n_per_mm: float):
        self._tree, self.stiffness_n_per_mm = tree, stiffness_n_per_mm
        self._surfaces, shapes = bodies(ordered(zones))
        self._shapes = shape_table(shapes)
        self.structures = (ANATOMY, *(zone.name for zone in ordered(zones)))

    def push(self, segments: Segments) -> ContactForces:
        """Forces of the anatomy on the tool in a pose."""
        pairs = self._tree.pairs_within(segments, 0.0)
        if not len(pairs):
            return NO_CONTACT
        kept = sides(pairs.distance, pairs.normal)
        force = -self.stiffness_n_per_mm * pairs.distance[kept][:, None] * pairs.normal[kept]
        deepest = float((-pairs.distance / segments.radius[pairs.segment]).max())
        return ContactForces(force, pairs.on_tool[kept], deepest)

    def distances(self, segments: Segments, reach: float) -> Array:
        """(B, S) distance of every structure to every segment's surface, cut at ``reach`` mm; negative inside."""
        found = np.full((len(self.structures), len(segments)), reach)
        for s in range(len(segments)):
            one = Segments(segments.start[s : s + 1], segments.end[s : s + 1], segments.radius[s : s + 1])
            for body, tree in enumerate((self._tree, *self._surfaces)):
                found[body, s] = tree.clearance(one, reach)
            along, row = segments.end[s] - segments.start[s], np.empty(10)
            for z in range(len(self._shapes.kind)):
                shape_row(self._shapes.kind[z], self._shapes.data[z], segments.start[s], along, one.radius[0], row)
                found[1 + len(self._surfaces) + z, s] = min(row[0], reach)
        return found


def sides(distance: Array, normal: Array) -> IndexArray:
    """Indices of the deepest pair of each side, deepest first: its normal is not within 60° of a deeper one's.

    distance: (N,); normal: (N, 3). The tool is one body: a side has one pair, whichever of its parts that is of.
    """
    left = np.argsort(distance, kind="stable")
    kept: list[np.intp] = []
    while len(left) and len(kept) < MOST_SIDES:
        kept.append(left[0])
        left = left[normal[left] @ normal[left[0]] < SIDE_COSINE]
    return np.array(kept, dtype=np.intp)
