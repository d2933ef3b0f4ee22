"""The three CT slices of a tab: where they stand, how grey they are, and their pictures for the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from app.scene.anatomy import SlicePicture
from app.scene.picking import Plane
from vfix_engine.imaging.volume import Axis, Volume

Floats = npt.NDArray[np.float64]

NORMALS: dict[Axis, int] = {"axial": 2, "coronal": 1, "sagittal": 0}


@dataclass(frozen=True)
class Greys:
    """Window and level in HU, with the name the page knows them by."""

    name: str = "sinus"
    window: float = 2000.0
    level: float = -200.0


class SliceDesk:
    """Slices through one place, the cross; every number is pulled into the volume."""

    def __init__(self, volume: Volume, cross: Floats) -> None:
        self._volume = volume
        self._bounds = np.asarray(volume.bounds)
        self.greys = Greys()
        self.cross = np.clip(cross, self._bounds[0], self._bounds[1])
        self._view: tuple[Any, dict[str, Any]] = (None, {})

    def move(self, axis: Axis, position_mm: float) -> None:
        normal = NORMALS[axis]
        self.cross = self.cross.copy()
        self.cross[normal] = float(np.clip(position_mm, self._bounds[0][normal], self._bounds[1][normal]))

    def set_cross(self, position: tuple[float, float, float] | Floats) -> None:
        self.cross = np.clip(np.asarray(position, dtype=np.float64), self._bounds[0], self._bounds[1])

    def key(self) -> Any:
        """Changes with everything the slices show."""
        return (*(round(float(value), 3) for value in self.cross), self.greys)

    def view(self) -> dict[str, Any]:
        """The page's section: each plane with the place of its pixels (centres), LPS mm."""
        if self._view[0] != self.key():
            self._view = (self.key(), self._describe())
        return self._view[1]

    def _describe(self) -> dict[str, Any]:
        planes = {}
        for axis, normal in NORMALS.items():
            image, affine = self._volume.slice_image(
                axis, float(self.cross[normal]), self.greys.window, self.greys.level
            )
            planes[axis] = {
                "position": round(float(self.cross[normal]), 3),
                "lo": float(self._bounds[0][normal]),
                "hi": float(self._bounds[1][normal]),
                "step": round(float(min(self._volume.spacing)), 3),
                "columns": int(image.shape[1]),
                "rows": int(image.shape[0]),
                "origin": affine[:3, 3].tolist(),
                "u": affine[:3, 0].tolist(),
                "v": affine[:3, 1].tolist(),
            }
        return {
            "cross": [round(float(value), 3) for value in self.cross],
            "window_name": self.greys.name,
            "window": self.greys.window,
            "level": self.greys.level,
            "planes": planes,
        }

    def pictures(self, which: str) -> list[SlicePicture]:
        """Slices as pictures for the scene: 'none', one axis, or 'all'."""
        found = []
        for axis, normal in _chosen(which).items():
            image, affine = self._volume.slice_image(
                axis, float(self.cross[normal]), self.greys.window, self.greys.level
            )
            found.append(SlicePicture(axis, image, affine))
        return found

    def planes(self, which: str) -> list[Plane]:
        """The slices in the scene as things a click can hit."""
        return [Plane(normal, float(self.cross[normal]), self._bounds) for normal in _chosen(which).values()]


def _chosen(which: str) -> dict[Axis, int]:
    return {axis: normal for axis, normal in NORMALS.items() if which in (axis, "all")}
