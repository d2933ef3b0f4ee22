"""What a run of a snake robot in a lumen is worth, and what is plotted of it, from the run alone; docs/metrics.md."""

from .behind_wall import BehindWall
from .holds import lumen_holds_of
from .samples import LumenSamples, lumen_samples_of
from .score import LumenScore, score_lumen_run
from .series import LumenSeries, lumen_series_of
from .task_replay import TaskReplay, task_replay
from .task_rows import TASKS, TaskItem, TaskRow, TaskScore

__all__ = [
    "TASKS",
    "BehindWall",
    "LumenSamples",
    "LumenScore",
    "LumenSeries",
    "TaskItem",
    "TaskReplay",
    "TaskRow",
    "TaskScore",
    "lumen_holds_of",
    "lumen_samples_of",
    "lumen_series_of",
    "score_lumen_run",
    "task_replay",
]
