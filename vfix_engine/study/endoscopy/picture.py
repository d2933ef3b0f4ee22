"""What a person sees of a snapshot in study I: the endoscope's picture, and what the task draws in it.

``PolypEye.seen`` is the one place where the person reads a snapshot, and it reads the camera's pose alone: joints,
depth, deviations, bounds and what holds the robot are not in the picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...pathway.pathway import TissueMotion
from ...worlds.snake.picture.camera_view import FIELD_DEG
from ...worlds.snake.snapshot import AtHand, SnakeSnapshot
from ..polyps.progress import PolypProgress, Sight
from ..polyps.task import PolypTask

FAR_MM = 60.0  # a polyp farther away is too small and dark to be noticed; assumed
DARK_MM = 35.0  # the lumen goes on where the wall is farther than that: it is dark there; assumed
_DARKEST = 0.75  # of the largest distance: places that look as dark as the darkest one
_RAYS = 7  # of the picture, across and down
_SAME_MM, _SAME_COS = 0.05, math.cos(math.radians(0.1))  # of the camera between two looks: the picture stands still
_EDGE = math.tan(math.radians(0.5 * FIELD_DEG))


class SeenPolyp(NamedTuple):
    """A polyp in the picture: which, (2,) degrees from the centre to the right and down, and mm from the lens."""

    number: int
    off_deg: Array
    distance_mm: float


class SeenLumen(NamedTuple):
    """A picture of study I.

    polyps: in it, not cleared and not hidden. dark_deg(): (2,) degrees from the centre to where the lumen goes on, None
    where the picture is all wall; found when it is looked for. marker: its colour, from 0 to 1. cleared: how many
    polyps have gone. moves: the picture is another one than that of the look before.
    """

    polyps: tuple[SeenPolyp, ...]
    dark_deg: Callable[[], Array | None]
    marker: float
    cleared: int
    moves: bool


class PolypEye:
    """Makes what is seen of a snapshot.

    Args:
        wall: the lumen's surface; sight: lines of sight to the polyps; motion: of the tissue, None: it is still.
    """

    def __init__(self, task: PolypTask, wall: Wall, sight: Sight, motion: TissueMotion | None = None) -> None:
        self._task, self._wall, self._sight, self._motion = task, wall, sight, motion
        edge = np.linspace(-_EDGE, _EDGE, _RAYS)
        x, y = np.meshgrid(edge, edge, indexing="ij")
        rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
        self._rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        self._before: Array | None = None

    def seen(self, snapshot: AtHand | SnakeSnapshot, progress: PolypProgress) -> SeenLumen:
        """The picture of a snapshot. progress: of the task, which draws the marker and removes polyps."""
        camera = snapshot.camera
        local = (self._task.targets(self._motion, snapshot.t) - camera[:3, 3]) @ camera[:3, :3]
        polyps = []
        for number in np.flatnonzero((local[:, 2] > 0.0) & (np.linalg.norm(local, axis=1) <= FAR_MM)).tolist():
            x, y, z = local[number].tolist()
            gone = progress.viewings[number].cleared_t is not None
            if gone or max(abs(x), abs(y)) > _EDGE * z or not self._sight(camera[:3, 3], number, snapshot.t):
                continue
            polyps.append(SeenPolyp(number, off_centre(local[number]), math.sqrt(x * x + y * y + z * z)))
        before, self._before = self._before, camera
        moves = before is None or moved(before, camera)
        return SeenLumen(tuple(polyps), partial(self._dark, camera), progress.marker, progress.cleared, moves)

    def _dark(self, camera: Array) -> Array | None:
        """Where the lumen goes on: the middle of the places that are about as far as the farthest."""
        distance = self._wall.seen(camera[:3, 3], self._rays @ camera[:3, :3].T)[0]
        distance = np.where(np.isfinite(distance), distance, 0.0)
        most = float(distance.max())
        if most < DARK_MM:
            return None
        return off_centre(self._rays[distance >= _DARKEST * most].mean(axis=0))


def moved(before: Array, camera: Array) -> bool:
    """Whether two cameras (4, 4) have different pictures, as an eye sees it."""
    apart = float(np.linalg.norm(camera[:3, 3] - before[:3, 3]))
    return apart > _SAME_MM or float(before[:3, 2] @ camera[:3, 2]) < _SAME_COS


def off_centre(local: Array) -> Array:
    """(2,) degrees from the optical axis to a place (3,) in the camera's frame, to the right and down."""
    aside = math.hypot(local[0], local[1])
    angle = math.degrees(math.atan2(aside, local[2]))
    found: Array = local[:2] * (angle / aside) if aside > 0.0 else np.zeros(2)
    return found
