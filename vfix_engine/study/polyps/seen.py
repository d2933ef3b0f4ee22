"""The share of a lumen's wall that the camera saw in a run."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, BoolArray
from ...pathway.pathway import TissueMotion
from ...worlds.snake.picture.camera_view import FIELD_DEG
from .placing import WallPlaces
from .series import PolypSeries

FAR_MM = 60.0  # a wall farther away than that is too dark to be examined; assumed
_EVERY_MM, _EVERY_DEG = 3.0, 4.0  # of the camera's motion between two pictures
_EDGE = math.tan(math.radians(0.5 * FIELD_DEG))


def seen_share(series: PolypSeries, places: WallPlaces) -> float:
    """Share, by area, of the wall between the first place of the task and its end that was in a picture.

    A triangle is seen when its middle is in the square picture, no farther than 60 mm and in a free line of sight. The
    wall is that of the tissue at rest: in moving tissue the camera is taken back as the pathway at the tip is.
    """
    way, wall = places.between(series.task.from_mm, series.task.end_mm), places.wall
    seen, left = np.zeros(len(way), dtype=bool), np.flatnonzero(way)
    for camera in _pictures(series):
        new = left[_in_picture(camera, wall.centre[left])]
        seen[new] = wall.free(camera[:3, 3], new)
        left = left[~seen[left]]
    return places.share(seen, way)


def _pictures(series: PolypSeries) -> list[Array]:
    """Cameras (4, 4) at rest, one for every 3 mm or 4° of motion."""
    kept: list[Array] = []
    most = math.cos(math.radians(_EVERY_DEG))
    for camera, s, t in zip(series.camera, series.tip_mm.tolist(), series.t.tolist(), strict=True):
        rest = _taken_back(camera, s, t, series.motion)
        moved = not kept or float(np.linalg.norm(rest[:3, 3] - kept[-1][:3, 3])) > _EVERY_MM
        if moved or float(rest[:3, 2] @ kept[-1][:3, 2]) < most:
            kept.append(rest)
    return kept


def _taken_back(camera: Array, s: float, t: float, motion: TissueMotion | None) -> Array:
    if motion is None:
        return camera
    rest = camera.copy()
    rest[:3, 3] -= motion(np.array([s]), t)[0][0]
    return rest


def _in_picture(camera: Array, points: Array) -> BoolArray:
    x, y, z = ((points - camera[:3, 3]) @ camera[:3, :3]).T
    aside = np.maximum(np.abs(x), np.abs(y))
    found: BoolArray = (z > 0.0) & (aside <= _EDGE * z) & (x * x + y * y + z * z <= FAR_MM * FAR_MM)
    return found
