"""What a planned tool pierces, in red: the tissue on its axis, drawn through everything."""

from __future__ import annotations

import numpy as np
import viser

from app.kit.values import Position
from app.scene import palette
from app.scene.view import SceneView

THICKNESS_MM = 3.0  # more than most tools: it is seen around them


class PiercedNodes:
    """A line from where the tissue begins to where it ends, or nothing."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._line: viser.LineSegmentsHandle | None = None

    def show(self, ends: tuple[Position, Position] | None) -> None:
        """Both ends in LPS mm; None where nothing is pierced."""
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
