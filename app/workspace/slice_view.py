"""The three CT slices of a client: where they are, their window of grey values, and their pictures for the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from app.scene.anatomy import SlicePicture
from app.scene.picking import PickingPlane
from app.workspace.sections import SliceGrid, SlicePlane, SlicesSection
from vfix_engine.arrays import Array
from vfix_engine.files.volume import Axis, Volume

NORMALS: dict[Axis, int] = {"axial": 2, "coronal": 1, "sagittal": 0}


@dataclass(frozen=True)
class Greys:
    """Window and level in HU, with their name on the page."""

    name: str = "sinus"
    window: float = 2000.0
    level: float = -200.0


class SliceView:
    """Slices through the crosshair; every number is clamped to the volume."""

    def __init__(self, volume: Volume, cross: Array, detail: Volume | None = None) -> None:
        """detail: a finer volume of a part, overlaid on the wide one in its range."""
        self._volume, self._detail = volume, detail
        self._bounds = np.asarray(volume.bounds)
        self.greys = Greys()
        self.cross = np.clip(cross, self._bounds[0], self._bounds[1])

    def move(self, axis: Axis, position_mm: float) -> None:
        normal = NORMALS[axis]
        self.cross = self.cross.copy()
        self.cross[normal] = float(np.clip(position_mm, self._bounds[0][normal], self._bounds[1][normal]))

    def set_cross(self, position: tuple[float, float, float] | Array) -> None:
        self.cross = np.clip(np.asarray(position, dtype=np.float64), self._bounds[0], self._bounds[1])

    def key(self) -> Any:
        """Changes with everything the slices show."""
        return (*self.cross.tolist(), self.greys)

    def section(self) -> SlicesSection:
        """The page's section: each plane with the place of its pixels (centres), LPS mm."""
        planes: dict[Axis, SlicePlane] = {}
        for axis, normal in NORMALS.items():
            position = float(self.cross[normal])
            grid = self._grid(self._volume, axis, position)
            detail = None
            if self._detail is not None and _reaches(self._detail, normal, position):
                detail = self._grid(self._detail, axis, position)
            planes[axis] = {
                "position": round(position, 3),
                "lo": float(self._bounds[0][normal]),
                "hi": float(self._bounds[1][normal]),
                "step": round(float(min(self._volume.spacing)), 3),
                "detail": detail,
                **grid,
            }
        return {
            "cross": [round(float(value), 3) for value in self.cross],
            "window_name": self.greys.name,
            "window": self.greys.window,
            "level": self.greys.level,
            "planes": planes,
        }

    def _grid(self, volume: Volume, axis: Axis, position: float) -> SliceGrid:
        """Size of a slice's picture, and the place of its pixel centres."""
        (rows, columns), affine = volume.slice_grid(axis, position)
        return {
            "columns": columns,
            "rows": rows,
            "origin": affine[:3, 3].tolist(),
            "u": affine[:3, 0].tolist(),
            "v": affine[:3, 1].tolist(),
        }

    def pictures(self, which: str) -> list[SlicePicture]:
        """Slices as pictures for the scene: 'none', one axis, or 'all'."""
        return [self._picture(axis, normal) for axis, normal in _chosen(which).items()]

    def _picture(self, axis: Axis, normal: int) -> SlicePicture:
        position = float(self.cross[normal])
        image, affine = self._volume.slice_image(axis, position, self.greys.window, self.greys.level)
        if self._detail is None or not _reaches(self._detail, normal, position):
            return SlicePicture(axis, image, affine)
        fine, fine_affine = self._detail.slice_image(axis, position, self.greys.window, self.greys.level)
        return SlicePicture(axis, *_inlaid(image, affine, fine, fine_affine))

    def planes(self, which: str) -> list[PickingPlane]:
        """The slices in the scene as things a click can hit."""
        return [PickingPlane(normal, float(self.cross[normal]), self._bounds) for normal in _chosen(which).values()]


def _reaches(volume: Volume, normal: int, position: float) -> bool:
    low, high = np.asarray(volume.bounds)[:, normal]
    return bool(low <= position <= high)


def _inlaid(
    image: npt.NDArray[np.uint8], affine: Array, fine: npt.NDArray[np.uint8], fine_affine: Array
) -> tuple[npt.NDArray[np.uint8], Array]:
    """A wide picture on the grid of a fine one, with the fine one inserted; and the positions of its pixels."""
    to_wide = np.linalg.inv(affine) @ fine_affine  # fine pixel to wide pixel
    scale, offset = np.diag(to_wide)[:2], to_wide[:2, 3]
    before = np.floor(offset / scale).astype(int)  # fine pixels left of and above the fine picture
    size = np.ceil((np.array(image.shape[1::-1]) - 1) / scale).astype(int)
    shift = np.array(
        [[scale[0], 0.0, offset[0] - before[0] * scale[0]], [0.0, scale[1], offset[1] - before[1] * scale[1]]]
    )
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    shape = (int(size[0]), int(size[1]))
    wide = cv2.warpAffine(image, shift, shape, flags=how, borderMode=cv2.BORDER_REPLICATE).astype(np.uint8, copy=False)
    rows, columns = fine.shape
    top, left = max(0, before[1]), max(0, before[0])
    part = wide[top : before[1] + rows, left : before[0] + columns]
    part[:] = fine[top - before[1] :, left - before[0] :][: part.shape[0], : part.shape[1]]
    placed = fine_affine.copy()
    placed[:3, 3] -= fine_affine[:3, 0] * before[0] + fine_affine[:3, 1] * before[1]
    return wide, placed


def _chosen(which: str) -> dict[Axis, int]:
    return {axis: normal for axis, normal in NORMALS.items() if which in (axis, "all")}
