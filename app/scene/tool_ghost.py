"""The tool at one position of a planned path: translucent, so that what it touches shows through."""

from __future__ import annotations

import numpy as np

from app.scene.robot import ToolNodes
from app.scene.view import SceneView
from vfix_engine.arrays import Array

OPACITY = 0.6


class ToolGhost:
    """Capsules of the tool, or nothing."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._tool = ToolNodes(view.scene, "/plan/tool", OPACITY)

    def show(self, pose: tuple[Array, Array, Array] | None) -> None:
        """Draw the tool. pose: starts (S, 3), ends (S, 3) and radii (S,) of the capsules, LPS mm; None for no tool."""
        empty = np.zeros((0, 3))
        with self._view.atomic():
            self._tool.place(*(pose or (empty, empty, np.zeros(0))))
        self._view.flush()

    def remove(self) -> None:
        self._tool.remove()
