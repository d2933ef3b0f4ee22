"""The marker on the server: one command, one section, one layer."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from extra_tabs.marker import SPEC, LayMarker

from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.scene.view import SceneView
from app.tabs.base import Tab
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError

RADIUS_MM = 110.0  # around the whole head: nothing can stand before it


class MarkerNodes:
    def __init__(self, view: SceneView) -> None:
        self._ball = view.scene.add_icosphere("/marker/ball", RADIUS_MM, color=(255, 0, 0))

    def show(self, position: npt.NDArray[np.float64]) -> None:
        self._ball.position = position

    def remove(self) -> None:
        self._ball.remove()


class MarkerTab(Tab):
    spec = SPEC

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._position: list[float] | None = None
        self._laid = 0

    def handle(self, command: ClientMessage) -> int:
        """Lay the marker where the slices cross; returns how often it was laid."""
        cross = self.workspace.case.cross
        if not isinstance(command, LayMarker) or cross is None:
            raise InputError("a marker needs slices to lie in.")
        self._position, self._laid = list(cross), self._laid + 1
        return self._laid

    def sections(self) -> Sections:
        at, laid = self._position, self._laid
        return {"marker": Section((at, laid), lambda: None if at is None else {"position": at, "laid": laid})}

    def layers(self) -> list[Layer[Any]]:
        at = self._position
        if at is None:
            return []
        return [Layer("marker.ball", tuple(at), MarkerNodes, lambda nodes: nodes.show(np.array(at)))]

    def hint(self) -> str:
        return "Press the button: a marker is laid where the slices cross."
