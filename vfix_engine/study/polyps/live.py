"""The progress of a drive's task while it is driven: from every row that the control process writes, as of its run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...pathway.pathway import TissueMotion
from ...robots.snake import SnakeModel
from ...runtime.command import COMMAND_SIZE
from ...runtime.system import Column
from .progress import PolypProgress, Sight
from .series import cameras
from .task import PolypTask

PICTURE_DEG = 35.0  # half of the picture's opening
FAR_MM = 60.0  # from which a polyp is hardly seen


class LiveProgress:
    """Steps ``PolypProgress`` with the rows of a drive; after the same rows it equals that of ``polyp_series``.

    progress: after the rows so far. in_picture: of the polyp that is aimed at and not viewed: it can be seen all the
    same, in the picture of ``PICTURE_DEG`` to each side and with a free line of sight.
    For a drive whose task begins before its first step.

    Args:
        motion: of the drive's tissue. columns: of the lines that are read, as ``RowReader.columns``.
    """

    def __init__(
        self, task: PolypTask, snake: SnakeModel, motion: TissueMotion | None, columns: Sequence[Column], sight: Sight
    ) -> None:
        self._task, self._snake, self._motion, self._sight = task, snake, motion, sight
        self._at = {column.name: place for place, column in enumerate(columns[COMMAND_SIZE:])}
        self._still = task.targets()
        self.progress = PolypProgress.at_start(task)
        self.in_picture = False

    @property
    def completed(self) -> bool:
        """Whether the end of the task is reached."""
        return self.progress.completed

    def read(self, lines: Array) -> PolypProgress:
        """Step with lines (n, w), each a command and a row."""
        rows = np.ascontiguousarray(lines[:, COMMAND_SIZE:])
        at, progress = self._at, self.progress
        if not progress.completed and len(rows):
            tip, times = rows[:, at["tip_s"]].tolist(), rows[:, at["t"]].tolist()
            for camera, s, t in zip(cameras(self._snake, rows, at), tip, times, strict=True):
                targets = self._still if self._motion is None else self._task.targets(self._motion, t)
                progress = progress.step(self._task, camera, s, t, targets, self._sight)
            self.in_picture = self._in_picture(progress, camera)
        self.progress = progress
        return progress

    def _in_picture(self, progress: PolypProgress, camera: Array) -> bool:
        aim, target = progress.aim, progress.target
        if progress.viewed or aim is None or target is None or aim.angle_deg > PICTURE_DEG or aim.distance_mm > FAR_MM:
            return False
        return self._sight(camera[:3, 3], target, progress.t)
