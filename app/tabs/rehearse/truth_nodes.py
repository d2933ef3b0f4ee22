"""The believed and the true tip in the scene."""

from __future__ import annotations

import numpy as np

from app.scene import palette
from app.scene.view import SceneView
from vfix_engine.arrays import Array

RADIUS_MM = 0.7
LABEL_MM = np.array([0.0, 0.0, 7.0])  # from a tip to its name: above the believed one, below the true one


class TruthNodes:
    """Two tips, and a line from where the robot has its own to where it is."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        scene, line = view.scene, np.zeros((1, 2, 3), dtype=np.float32)
        self._believed = scene.add_icosphere(
            "/truth/believed", RADIUS_MM, color=palette.ACCENT, opacity=0.6, cast_shadow=False, receive_shadow=False
        )
        self._true = scene.add_icosphere(
            "/truth/true", RADIUS_MM, color=palette.TRUE_TIP, cast_shadow=False, receive_shadow=False
        )
        self._apart = scene.add_line_segments("/truth/apart", line, palette.TRUE_TIP, thickness=0.25)
        self._names = [
            view.labels.add(f"/truth/{name}_label", name, "item", font_screen_scale=0.8, anchor="center-center")
            for name in ("believed", "true")
        ]

    def show(self, believed: Array, true: Array) -> None:
        """Both tips (3,), LPS mm."""
        with self._view.atomic():
            for node, at in zip((self._believed, self._true), (believed, true), strict=True):
                node.position = at
            for name, at in zip(self._names, (believed + LABEL_MM, true - LABEL_MM), strict=True):
                name.position = at
            self._apart.points = np.array([[believed, true]], dtype=np.float32)
        self._view.flush()

    def remove(self) -> None:
        for node in (self._believed, self._true, self._apart):
            node.remove()
        for name in self._names:
            name.remove()
