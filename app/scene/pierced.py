"""The tissue that a planned tool pierces: a red line on its axis, visible through everything."""

from __future__ import annotations

import numpy as np
import viser

from app.kit.values import Position
from app.scene import palette
from app.scene.view import SceneView

THICKNESS_MM = 3.0  # thicker than most tools, so that it is visible around them


class PiercedNodes:
    """A line from the beginning to the end of the tissue, or nothing."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._line: viser.LineSegmentsHandle | None = None

    def show(self, ends: tuple[Position, Position] | None) -> None:
        """Draw the line between both ends in LPS mm; None if nothing is pierced."""
        if ends is None:
            if self._line is not None:
                self._line.visible = False
            return
        places = np.array([ends], dtype=np.float32)
        if self._line is None:
            self._line = self._scene.add_line_segments(
                "/plan/pierced", places, palette.PIERCED, thickness=THICKNESS_MM, thickness_units="world"
            )
            return
        self._line.points = places
        self._line.visible = True

    def remove(self) -> None:
        if self._line is not None:
            self._line.remove()
