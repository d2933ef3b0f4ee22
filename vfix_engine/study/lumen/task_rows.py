"""Where a task adds its own rows to the score of a run: the polyps and labels of Kwok 2013, studies I and II."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...runtime.run import Run


@dataclass(frozen=True)
class ScoreRow:
    """One figure of a task as it is shown: its name, value, unit, and the digits after the point.

    value: None where it is not defined. worse: whether it is to stand out.
    """

    name: str
    value: float | None
    unit: str = ""
    digits: int = 0
    worse: bool = False


@dataclass(frozen=True)
class TaskScore:
    """What a run of a task is worth. title: of the task; completed: it was done to its end; rows: in their order."""

    title: str
    completed: bool
    rows: tuple[ScoreRow, ...]


# By name of a task: its score of a run, None for a run that is of no such task. A task's module adds its own.
TASK_ROWS: dict[str, Callable[[Run], TaskScore | None]] = {}


def task_score(run: Run) -> TaskScore | None:
    """The score of the task that a run is of; None where it is of none."""
    return next((found for of in TASK_ROWS.values() if (found := of(run)) is not None), None)
