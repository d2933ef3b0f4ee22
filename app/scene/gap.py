"""The gap between a planned tool and the bone nearest to it: a line with its length, seen through everything."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import viser

from app.scene import palette
from app.scene.labels import SceneLabel
from app.scene.view import SceneView
from vfix_engine.arrays import Array

_THICKNESS_MM = 0.6  # a width in mm: such lines are drawn where something hides them, too


class Gap(NamedTuple):
    """Ends (3,) of the gap in LPS mm, on the tool's surface and on bone, and its length in mm."""

    on_tool: Array
    on_bone: Array
    length_mm: float


class GapNodes:
    """The line and its label, or nothing."""

    def __init__(self, view: SceneView) -> None:
        self._scene, self._labels = view.scene, view.labels
        self._line: viser.LineSegmentsHandle | None = None
        self._label: SceneLabel | None = None

    def show(self, gap: Gap | None) -> None:
        """Draw a gap; None for none."""
        self.remove()
        if gap is None:
            return
        ends = np.array([[gap.on_tool, gap.on_bone]], dtype=np.float32)
        self._line = self._scene.add_line_segments(
            "/plan/gap", ends, palette.PIERCED, thickness=_THICKNESS_MM, thickness_units="world"
        )
        self._label = self._labels.add(
            "/plan/gap_label",
            f"{max(gap.length_mm, 0.0):.2f} mm to bone",
            "gap",
            gap.on_bone,
            font_screen_scale=0.8,
            anchor="center-left",
            depth_test=False,
        )

    def remove(self) -> None:
        for node in (self._line, self._label):
            if node is not None:
                node.remove()
        self._line = self._label = None
