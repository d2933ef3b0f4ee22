"""The camera of one client's scene."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.kit.values import Position
from app.scene.camera import CameraPose, Lens, standard_view
from app.scene.view import SceneView
from app.workspace.case_view import CaseView
from app.workspace.sections import CameraSection, LabelView, ProjectAnswer
from vfix_engine.arrays import Array

NEAR_MARGIN_MM = 12.0  # margin around the positions of a near view
LEAST_RADIUS_MM = 45.0
STILL_MM = 1.0  # from its standard view, a camera that nobody has moved


class CameraView:
    """Owned by the session's thread."""

    def __init__(self, case: CaseView) -> None:
        self._case = case
        self._scene: SceneView | None = None
        self._lens: Lens | None = None
        self._pivot: Position | None = None
        self._labels_by_page = False
        self._turned = False  # turned to a view of the head since the scene connected
        self._view = ""  # the last standard view
        self._pose: CameraPose | None = None  # of the camera in it
        self._size = (0, 0)  # [pixels] of the canvas that it was fitted to
        self.places: Callable[[], list[Position]] = list  # positions that a near view has to show

    def attach(self, scene: SceneView | None) -> None:
        """The client's scene is connected, or gone."""
        self._scene = scene
        self._pivot = None
        self._lens = None  # also for a new scene: its first camera is viser's own, not a view of the head
        self._turned = False
        if scene is not None:
            scene.labels.leave_to_page(self._labels_by_page)

    def moved(self, lens: Lens) -> None:
        if not self._turned:
            return
        self._lens = lens
        away = np.inf if self._pose is None else float(np.linalg.norm(lens.position - self._pose.position))
        if (lens.width, lens.height) != self._size and away < STILL_MM:  # another layout, and nobody has turned it
            self.look_from(self._view)

    def look_from(self, name: str) -> None:
        """Turn to a standard view: of the whole case, or with 'nose' near, of what the tabs show."""
        if self._scene is None:
            return
        self._pivot, self._turned = None, True
        centre, half = self._case.extent()
        if name == "nose":
            places = np.array(self.places())
            if len(places):  # without a position a near view would be of the inside of the head: the whole case then
                centre = (places.min(axis=0) + places.max(axis=0)) / 2.0
                around = 0.5 * float(np.linalg.norm(np.ptp(places, axis=0))) + NEAR_MARGIN_MM
                half = np.full(3, max(LEAST_RADIUS_MM, around))
        lens = self._scene.lens
        self._size = (0, 0) if lens is None else (lens.width, lens.height)
        self._view, self._pose = name, standard_view(name, centre, half, self._size)
        self._scene.look_from(self._pose)

    def turn_about(self, position: Array) -> None:
        """Rotate about a position from now on; the picture stays. The browser does so, where it can."""
        x, y, z = (round(float(value), 3) for value in position)
        self._pivot = (x, y, z)

    def leave_labels_to_page(self, by_page: bool) -> None:
        """Whether the page writes the labels over its frame, or viser within it."""
        self._labels_by_page = by_page
        if self._scene is not None:
            self._scene.labels.leave_to_page(by_page)

    def labels(self) -> list[LabelView]:
        """Labels at positions of the scene."""
        if self._scene is None:
            return []
        return [
            {"kind": label.kind, "words": label.text, "position": [round(float(x), 3) for x in label.position]}
            for label in self._scene.labels.shown()
        ]

    def project(self, points: list[Position]) -> ProjectAnswer:
        """Positions on the canvas as fractions of its size; null behind the camera."""
        lens = None if self._scene is None else self._scene.lens
        if lens is None:
            return {"places": None}
        places = lens.project(np.array(points, dtype=np.float64).reshape(-1, 3))
        return {"places": [place.tolist() if np.isfinite(place).all() else None for place in places]}

    def section(self) -> CameraSection:
        lens = self._lens
        return {
            "view_height_mm": None if lens is None or lens.height <= 0 else round(lens.view_height_mm, 2),
            "pivot": None if self._pivot is None else list(self._pivot),
        }
