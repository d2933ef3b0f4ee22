"""The camera of one client's scene: where it looks from, and what it sees."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from app.scene.camera import Lens, standard_view
from app.scene.view import SceneView
from app.views.case_view import CaseView, Position
from app.views.sections import CameraSection, ProjectAnswer

NEAR_MARGIN_MM = 12.0  # around the places of a near view
LEAST_RADIUS_MM = 45.0
NOSE_SHARE = 0.45  # of the case's radius, where no step has a place to show


class CameraView:
    """Owned by the session's thread."""

    def __init__(self, case: CaseView) -> None:
        self._case = case
        self._scene: SceneView | None = None
        self._lens: Lens | None = None
        self.places: Callable[[], list[Position]] = list  # what a near view has to show

    def attach(self, scene: SceneView | None) -> None:
        """The client's scene is there, or gone."""
        self._scene = scene
        if scene is None:
            self._lens = None

    def moved(self, lens: Lens) -> None:
        self._lens = lens

    def look_from(self, name: str) -> None:
        """Turn to a standard view: 'nose' is near, at what the steps show; the others see all of the case."""
        if self._scene is None:
            return
        centre, radius = self._case.extent()
        if name == "nose":
            places = np.array(self.places())
            if len(places):
                centre = (places.min(axis=0) + places.max(axis=0)) / 2.0
                around = 0.5 * float(np.linalg.norm(np.ptp(places, axis=0))) + NEAR_MARGIN_MM
                radius = max(LEAST_RADIUS_MM, around)
            else:
                radius *= NOSE_SHARE
        self._scene.look_from(standard_view(name, centre, radius))

    def project(self, points: list[Position]) -> ProjectAnswer:
        """Places on the canvas in parts of its size; null behind the camera."""
        lens = None if self._scene is None else self._scene.lens()
        if lens is None:
            return {"places": None}
        places = lens.project(np.array(points, dtype=np.float64).reshape(-1, 3))
        return {"places": [place.tolist() if np.isfinite(place).all() else None for place in places]}

    def section(self) -> CameraSection:
        lens = self._lens
        return {
            "view_height_mm": None if lens is None or lens.height <= 0 else round(lens.mm_per_pixel * lens.height, 2)
        }
