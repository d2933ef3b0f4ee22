"""Where a robot is against the wall of its lumen: how far its lens is from it, and how deep its links are behind it."""

from __future__ import annotations

import time

import numpy as np

from app.lumen.paths import RoutePath
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.worlds.snake.link_depth import DeepestLink, LinkDepth
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

EVERY_S = 0.25  # between two measurements of the links, which take milliseconds, for any number of pages


class RobotWall:
    """The wall of a lumen at rest, for every page that watches a drive. Thread-safe.

    Args:
        mesh: its surface, LPS mm, normals outwards. path: that the robot is driven along.
    """

    def __init__(self, mesh: TriangleMesh, path: RoutePath) -> None:
        from vfix_engine.snake.conform.conforming import driven_curve  # slow to load

        if path.base is None:
            curve = driven_curve(path.lumen.pathway, path.lumen.curve)
            start, ahead = curve.position(0.0), curve.tangent(0.0)
        else:
            start, ahead = path.base[:3, 3], path.base[:3, 2]
        self._depth = LinkDepth(mesh, start, ahead)
        self._last = -np.inf, DeepestLink(0.0, 0)  # when the links were measured, in s, and what was found

    def lens_mm(self, camera: Array) -> float:
        """Distance of the lens of a camera (4, 4), transform_camera_to_patient; negative behind the wall."""
        return float(self._depth.clearance(np.asarray(camera)[None, :3, 3])[0])

    def deepest(self, snapshot: SnakeSnapshot) -> DeepestLink:
        """The link that is deepest behind the wall, at most ``EVERY_S`` old."""
        at, found = self._last
        if time.monotonic() - at >= EVERY_S:
            capsules = np.asarray(snapshot.capsules)
            chain = np.concatenate([capsules[:, :3], capsules[-1:, 3:6]])
            found = self._depth.deepest(chain, float(capsules[0, 6]), np.isfinite(snapshot.bounds))
            self._last = time.monotonic(), found
        return found
