"""Depth of the links of a snake behind the triangles of a lumen at rest, from where they are alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, BoolArray
from ...geometry.mesh import TriangleMesh
from ...proximity.fields.side import SurfaceSide
from ...proximity.proximity import ProximityTree

_ALONG_MM = 2.0  # between two positions on a link's axis
_ENTERING = 2  # links inside, counted from the base, that may stand in the opening of the lumen


class DeepestLink(NamedTuple):
    """How deep the deepest link is behind the wall, mm, and its number from the base; 0 and 0 where none is."""

    mm: float
    link: int


class LinkDepth:
    """The wall of a lumen that does not move.

    The ball about a position on a link's axis is as deep as the distance by which it would have to move to be inside,
    as in ``WallDepth``, which asks the links' vertices too and needs the state of a drive.

    Args:
        mesh: the surface, LPS mm, normals outwards; where it is open, nothing is behind it.
        start, ahead: (3,) mm where the robot enters, and a unit vector from there into the lumen. What is before that
            plane is not in the lumen yet, of the links next to it.
    """

    def __init__(self, mesh: TriangleMesh, start: Array, ahead: Array) -> None:
        self._tree = ProximityTree(mesh)
        self._side = SurfaceSide(self._tree)
        self._start, self._ahead = np.asarray(start), np.asarray(ahead)

    def clearance(self, points: Array) -> Array:
        """Distance (n,) of points (n, 3) to the wall in mm, negative behind it."""
        distance = self._tree.point_distance(points)[0]
        found: Array = np.where(self._side.outside(points), -distance, distance)
        return found

    def deepest(self, chain: Array, radius_mm: float, inside: BoolArray) -> DeepestLink:
        """The link that is deepest behind the wall.

        Args:
            chain: (L + 1, 3) mm, the joints from the base on, last the tip. radius_mm: of the links.
            inside: (L,) the links to be measured, those in the pathway.
        """
        links = np.flatnonzero(inside)
        if not len(links):
            return DeepestLink(0.0, 0)
        axes = chain[links + 1] - chain[links]
        count = int(np.ceil(np.linalg.norm(axes, axis=1).max() / _ALONG_MM))
        share = np.arange(1, count + 1) / count  # the ball in a joint belongs to the link before it
        centre = (chain[links, None] + share[:, None] * axes[:, None]).reshape(-1, 3)
        link = np.repeat(links, count)
        depth = radius_mm - self.clearance(centre)
        before = (centre - self._start) @ self._ahead < radius_mm
        depth[before & (link < links[0] + _ENTERING)] = 0.0
        worst = int(depth.argmax())
        return DeepestLink(float(depth[worst]), int(link[worst]) + 1) if depth[worst] > 0.0 else DeepestLink(0.0, 0)
