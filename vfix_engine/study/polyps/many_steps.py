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

_AT_ONCE = 4096  # steps whose targets are measured at once, for memory


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
    if (np.diff(t, prepend=progress.t) < 0.0).any():
        raise InputError("times of steps have to ascend: begin with PolypProgress.at_start")
    count, k, still = len(t), 0, task.targets()
    target, viewed, marker = np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=bool), np.zeros(count)
    near, ends = _may_be_viewed(task, motion, cameras, t), tip_mm >= task.done_mm
    ends[-1:] = True  # the last step has its aim
    cleared, busy = -1, np.empty(0, dtype=np.int64)
    while k < count and not progress.completed:
        if progress.cleared != cleared:
            cleared = progress.cleared
            near &= [viewing.cleared_t is None for viewing in progress.viewings]
            busy = np.flatnonzero(near.any(axis=1) | ends)
        until = k if progress.viewed else int(busy[np.searchsorted(busy, k)])
        if until > k:
            target[k:until], k = progress.nearest(task, tip_mm[k:until]), until
        now, targets = float(t[k]), still if motion is None else task.targets(motion, float(t[k]))
        progress = progress.step(task, cameras[k], float(tip_mm[k]), now, targets, sight, np.flatnonzero(near[k]))
        target[k] = -1 if progress.target is None else progress.target
        viewed[k], marker[k] = progress.viewed, progress.marker
        k += 1
    return Steps(target[:k], viewed[:k], marker[:k], progress)


def _may_be_viewed(task: PolypTask, motion: TissueMotion | None, cameras: Array, t: Array) -> BoolArray:
    """``may_be_within`` of all polyps after each step, (n, p)."""
    found = np.empty((len(t), len(task.polyps)), dtype=bool)
    still = task.targets()[None]
    for begin in range(0, len(t), _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        moved = still if motion is None else np.stack([task.targets(motion, now) for now in t[part].tolist()])
        found[part] = may_be_within(cameras[part], moved)
    return found
