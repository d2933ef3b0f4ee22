"""The progress of a drive's task while it is driven: from every row that the control process writes, as of its run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...pathway.pathway import TissueMotion
from ...robots.snake import SnakeModel
from ...runtime.command import COMMAND_SIZE
from ...runtime.system import Column
from .aiming import Aim, aim_at
from .many_steps import after_steps
from .progress import PolypProgress, Sight
from .series import cameras
from .task import RADIUS_MM, PolypTask

PICTURE_DEG = 35.0  # half of the picture's opening
FAR_MM = 200.0  # beyond which the picture of a colon draws nothing


@dataclass(frozen=True, eq=False)
class PolypMoment:
    """Study I at one moment, as it is shown. motion: of the tissue, None where it is still.

    seen: while none is viewed, the nearest polyp that is left and can be seen all the same: some of its ball is in the
    picture of ``PICTURE_DEG`` to each side, and the line of sight to its middle is free; None for none.
    """

    task: PolypTask
    motion: TissueMotion | None
    progress: PolypProgress
    seen: Aim | None = None


class LiveProgress:
    """Steps ``PolypProgress`` with the rows of a drive; after the same rows it equals that of ``polyp_series``.

    moment: after the rows so far. The first row is the first one of the task.

    Args:
        motion: of the drive's tissue. columns: of the lines that are read, as ``RowReader.columns``.
    """

    def __init__(
        self, task: PolypTask, snake: SnakeModel, motion: TissueMotion | None, columns: Sequence[Column], sight: Sight
    ) -> None:
        self._task, self._snake, self._motion, self._sight = task, snake, motion, sight
        self._at = {column.name: place for place, column in enumerate(columns[COMMAND_SIZE:])}
        self.moment = PolypMoment(task, motion, PolypProgress.at_start(task))

    @property
    def progress(self) -> PolypProgress:
        """After the rows so far."""
        return self.moment.progress

    @property
    def completed(self) -> bool:
        """Whether the end of the task is reached."""
        return self.progress.completed

    def read(self, lines: Array) -> PolypProgress:
        """Step with lines (n, w), each a command and a row."""
        rows = np.ascontiguousarray(lines[:, COMMAND_SIZE:])
        at, progress = self._at, self.progress
        if progress.completed or not len(rows):
            return progress
        seen_from, tip, t = cameras(self._snake, rows, at), rows[:, at["tip_s"]], rows[:, at["t"]]
        target, *_, progress = after_steps(progress, self._task, self._motion, seen_from, tip, t, self._sight)
        camera, targets = seen_from[len(target) - 1], self._task.targets(self._motion, progress.t)
        seen = None if progress.viewed else nearest_seen(progress, camera, targets, self._sight)
        self.moment = PolypMoment(self._task, self._motion, progress, seen)
        return progress


def nearest_seen(progress: PolypProgress, camera: Array, targets: Array, sight: Sight) -> Aim | None:
    """How a camera (4, 4) sees the nearest polyp that is left and at least in part in its picture; None for none.

    targets: (n, 3) LPS mm, as of ``PolypProgress.step``.
    """
    away = np.linalg.norm(targets - camera[:3, 3], axis=1)
    for index in np.argsort(away).tolist():
        if away[index] > FAR_MM:
            break
        if progress.viewings[index].cleared_t is not None:
            continue
        aim = aim_at(camera, targets[index])
        ball_deg = math.degrees(math.asin(RADIUS_MM / max(RADIUS_MM, away[index])))
        if aim.angle_deg <= PICTURE_DEG + ball_deg and sight(camera[:3, 3], index, progress.t):
            return aim
    return None
