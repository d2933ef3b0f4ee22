"""What a person sees of a snapshot in study II: labels in the endoscope's picture, with arrow and object.

``LabelEye.seen`` is the one place where the person reads a snapshot, and it reads the camera's pose alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...worlds.snake.picture.camera_view import FIELD_DEG
from ...worlds.snake.snapshot import AtHand, SnakeSnapshot
from ..diathermy.labels import HALF_MM, LINE_MM, Label
from ..diathermy.task import DiathermyState
from .picture import moved, off_centre

_EDGE = math.tan(math.radians(0.5 * FIELD_DEG))
_FREE_MM = 1.0  # a label stands so far off the wall that nothing nearer hides it


class SeenLabel(NamedTuple):
    """A label in the picture, whose object's aimed end is in it.

    number: of the label, which is printed on it. end_deg, tip_deg: (2,) degrees from the centre, where the marker is,
    to the object's aimed end and to the arrow's tip. left: of the arrow, as a share. deg_per_mm: on the label.
    """

    number: int
    end_deg: Array
    tip_deg: Array
    left: float
    deg_per_mm: float


class SeenCavity(NamedTuple):
    """A picture of study II. done: numbers of labels whose object has gone. moves: as of ``SeenLumen``."""

    labels: tuple[SeenLabel, ...]
    done: frozenset[int]
    moves: bool


class LabelEye:
    """Makes what is seen of a snapshot."""

    def __init__(self, labels: Sequence[Label], wall: Wall) -> None:
        self._labels, self._wall = tuple(labels), wall
        self._before: Array | None = None

    def seen(self, snapshot: AtHand | SnakeSnapshot, task: DiathermyState) -> SeenCavity:
        """The picture of a snapshot. task: what it draws: which objects are left, and how much of them."""
        camera, found = snapshot.camera, []
        for number, (label, progress) in enumerate(zip(self._labels, task.labels, strict=True)):
            if progress.done_s is not None:
                continue
            one = self._label(camera, number, label, progress.end_mm)
            if one is not None:
                found.append(one)
        before, self._before = self._before, camera
        done = frozenset(n for n, progress in enumerate(task.labels) if progress.done_s is not None)
        return SeenCavity(tuple(found), done, before is None or moved(before, camera))

    def _label(self, camera: Array, number: int, label: Label, end_mm: float) -> SeenLabel | None:
        eye = camera[:3, 3]
        end, tip = ((label.at(mm) - eye) @ camera[:3, :3] for mm in (end_mm, HALF_MM))
        away = float(np.linalg.norm(end))
        if end[2] <= 0.0 or float(np.abs(end[:2]).max()) > _EDGE * end[2] or label.normal @ camera[:3, 2] >= 0.0:
            return None
        if float(self._wall.seen(eye, camera[:3, :3] @ end / away)[0]) < away - _FREE_MM:
            return None
        return SeenLabel(
            number, off_centre(end), off_centre(tip), (HALF_MM - end_mm) / LINE_MM, math.degrees(1.0 / away)
        )
