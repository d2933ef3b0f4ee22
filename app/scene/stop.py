"""The place where a tool that does not get to the end of its path stops: a mark that is seen through everything."""

from __future__ import annotations

from app.kit.values import Position
from app.scene.labels import SceneLabel
from app.scene.view import SceneView


class StopNode:
    """One mark, or nothing."""

    def __init__(self, view: SceneView) -> None:
        self._labels = view.labels
        self._mark: SceneLabel | None = None

    def show(self, place: Position | None) -> None:
        """Mark a place in LPS mm; None where nothing stops the tool."""
        if place is None:
            self.remove()
            return
        if self._mark is None:
            self._mark = self._labels.add(
                "/plan/stop", "stops here", "stop", font_screen_scale=0.8, anchor="center-left", depth_test=False
            )
        self._mark.position = place

    def remove(self) -> None:
        if self._mark is not None:
            self._mark.remove()
            self._mark = None
