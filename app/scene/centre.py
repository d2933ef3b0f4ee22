"""The remote centre in the scene: a ring that the tool passes, and its name."""

from __future__ import annotations

import numpy as np

from app.scene import palette
from app.scene.view import SceneView
from vfix_engine.arrays import Array
from vfix_engine.virtual_fixtures.polyhedra import across

_CORNERS = 48
_NAME_OFF_MM = 2.0  # beyond the ring


class CentreNodes:
    """A ring with the radius of the tolerance, perpendicular to the direction in which the tool enters."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        line = np.zeros((1, 2, 3), dtype=np.float32)
        self._ring = view.scene.add_line_segments("/centre/ring", line, palette.CENTRE, thickness=0.5)
        self._name = view.labels.add(
            "/centre/name", "remote centre", "centre", font_screen_scale=0.85, anchor="top-center"
        )

    def show(self, point: Array, into: Array, radius: float) -> None:
        """Draw the centre. point (3,): LPS mm. into (3,): unit vector of the entering tool. radius: mm."""
        angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
        round_it = np.column_stack([np.cos(angles), np.sin(angles)])
        ring = point + radius * round_it @ across(into)
        with self._view.atomic():
            self._ring.points = np.stack([ring[:-1], ring[1:]], axis=1).astype(np.float32)
            self._name.position = point - (radius + _NAME_OFF_MM) * np.array([0.0, 0.0, 1.0])
        self._view.flush()

    def remove(self) -> None:
        for node in (self._ring, self._name):
            node.remove()
