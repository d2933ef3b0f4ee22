"""How far the lens of a robot is from the wall of its lumen, in front of it or behind."""

from __future__ import annotations

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.fields.side import SurfaceSide
from vfix_engine.proximity.proximity import ProximityTree


class LensWall:
    """The wall of a lumen at rest.

    Args:
        mesh: its surface, LPS mm, normals outwards; where it is open, no lens is behind it.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        self._tree = ProximityTree(mesh)
        self._side = SurfaceSide(self._tree)

    def distance_mm(self, camera: Array) -> float:
        """Of the lens of a camera (4, 4), transform_camera_to_patient; negative behind the wall."""
        eye = np.asarray(camera)[:3, 3][None]
        away = float(self._tree.point_distance(eye)[0][0])
        return -away if self._side.outside(eye)[0] else away
