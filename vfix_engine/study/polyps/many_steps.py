"""The progress of study I over many steps: equal to ``PolypProgress.step`` for each of them, and many times as fast.

While no polyp can be viewed and none was, a step changes nothing that the next one reads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, BoolArray, IntArray
from ...errors import InputError
from ...pathway.pathway import TissueMotion
from .aiming import may_be_within
from .progress import PolypProgress, Sight
from .task import PolypTask

_AT_ONCE = 4096  # steps whose targets are measured at once


class Steps(NamedTuple):
    """n steps, up to the end of the task. target: (n,) index of the polyp that is aimed at, −1: none.

    viewed: (n,); marker: (n,) colour value; progress: after the last step.
    """

    target: IntArray
    viewed: BoolArray
    marker: Array
    progress: PolypProgress


def after_steps(
    progress: PolypProgress,
    task: PolypTask,
    motion: TissueMotion | None,
    cameras: Array,
    tip_mm: Array,
    t: Array,
    sight: Sight,
) -> Steps:
    """Make steps from ``progress`` on.

    Args:
        cameras: (n, 4, 4) transform_camera_to_patient after each step; tip_mm: (n,) arc length of the tip; t: (n,) s.
        motion: of the tissue, None where it is still.

    Raises:
        InputError: a time before that of the step before it.
    """
    if len(t) and (t[0] < progress.t or (np.diff(t) < 0.0).any()):
        raise InputError("times of steps have to ascend: begin with PolypProgress.at_start")
    found = [_Columns.of(0)]
    for begin in range(0, len(t), _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        if progress.completed:
            break
        progress = _part(progress, task, motion, cameras[part], tip_mm[part], t[part], sight, found)
    target, viewed, marker = (np.concatenate(column) for column in zip(*found, strict=True))
    return Steps(target, viewed, marker, progress)


class _Columns(NamedTuple):
    target: IntArray
    viewed: BoolArray
    marker: Array

    @classmethod
    def of(cls, count: int) -> _Columns:
        return cls(np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=bool), np.zeros(count))


def _part(
    progress: PolypProgress,
    task: PolypTask,
    motion: TissueMotion | None,
    cameras: Array,
    tip_mm: Array,
    t: Array,
    sight: Sight,
    found: list[_Columns],
) -> PolypProgress:
    count, columns = len(t), _Columns.of(len(t))
    still = task.targets()[None]
    targets = still if motion is None else np.stack([task.targets(motion, now) for now in t.tolist()])
    near = may_be_within(cameras, targets)
    near &= [viewing.cleared_t is None for viewing in progress.viewings]
    counts = near.any(axis=1) | (tip_mm >= task.done_mm)
    counts[-1] = True  # so that the last one has its aim
    busy = np.flatnonzero(counts)
    k = 0
    while k < count and not progress.completed:
        if not (counts[k] or progress.viewed):
            end = int(busy[np.searchsorted(busy, k)])
            columns.target[k:end] = progress.nearest(task, tip_mm[k:end])
            k = end
        else:
            now = targets[k if motion is not None else 0]
            progress = progress.step(
                task, cameras[k], float(tip_mm[k]), float(t[k]), now, sight, np.flatnonzero(near[k])
            )
            columns.target[k] = -1 if progress.target is None else progress.target
            columns.viewed[k], columns.marker[k] = progress.viewed, progress.marker
            k += 1
    found.append(_Columns(columns.target[:k], columns.viewed[:k], columns.marker[:k]))
    return progress
