"""What a run of a snake robot in a lumen is worth, and what is plotted of it, from the run alone; docs/metrics.md.

Names are loaded on first access: what tells a task of a run needs none of the snake's world.
No module has the name of what it holds: importing it would hide that.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .behind_wall import BehindWall
    from .holds import lumen_holds_of
    from .replay import TaskReplay, task_replay
    from .samples import LumenSamples, lumen_samples_of
    from .score import LumenScore, score_lumen_run
    from .series import LumenSeries, lumen_series_of
    from .task_rows import TASKS, TaskItem, TaskRow, TaskScore

_WHERE = {
    "BehindWall": "behind_wall", "LumenSamples": "samples", "LumenScore": "score", "LumenSeries": "series",
    "TASKS": "task_rows", "TaskItem": "task_rows", "TaskReplay": "replay", "TaskRow": "task_rows",
    "TaskScore": "task_rows", "lumen_holds_of": "holds", "lumen_samples_of": "samples", "lumen_series_of": "series",
    "score_lumen_run": "score", "task_replay": "replay",
}  # fmt: skip

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


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f".{_WHERE[name]}", __name__), name)
