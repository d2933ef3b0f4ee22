"""Where a task adds its own rows to the score of a run: the polyps and labels of Kwok 2013, studies I and II."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run


@dataclass(frozen=True)
class TaskRow:
    """One figure of a task as it is shown: its name, value, unit, and the digits after the point.

    value: None where it is not defined. worse: whether it is to stand out.
    """

    name: str
    value: float | None
    unit: str = ""
    digits: int = 0
    worse: bool = False


@dataclass(frozen=True)
class TaskItem:
    """One polyp or label of a task. name: with its number, as in the pictures; done_s: when, None where it was not.

    share: of a label's arrow that was cut; of a polyp 1 or 0.
    """

    name: str
    done_s: float | None
    share: float


@dataclass(frozen=True)
class TaskScore:
    """What a run of a task is worth.

    title: of the task; completed: it was done to its end; rows: in their order. result: the outcome in words.
    lacking: what of it is not known and why, '' for nothing. items: by their numbers, none where views are not known.
    """

    title: str
    completed: bool
    rows: tuple[TaskRow, ...]
    lacking: str = ""
    result: str = ""
    items: tuple[TaskItem, ...] = ()


# Modules with functions `task_score`, `task_figures`, `task_told` as those below, and `task_live` as `task_replay` has
# it: None for a run of no such task.
TASKS = ["vfix_engine.study.polyps.rows", "vfix_engine.study.diathermy.rows"]


def task_score(run: Run, wall: TriangleMesh | None = None) -> TaskScore | None:
    """The score of the task that a run is of; None where it is of none.

    wall: of the lumen that was driven through, which a run does not have; a task with lines of sight says what it lacks
    without it.
    """
    for module in TASKS:
        found: TaskScore | None = import_module(module).task_score(run, wall)
        if found is not None:
            return found
    return None


def task_figures(run: Run, wall: TriangleMesh | None = None) -> dict[str, float | None]:
    """The figures of the task that a run is of, by name, None where one is not defined; empty of a run of none.

    wall: as in `task_score`; what needs it is None without it. docs/lumen_tasks.md has the names.
    """
    for module in TASKS:
        found: dict[str, float | None] | None = import_module(module).task_figures(run, wall)
        if found is not None:
            return found
    return {}


def task_told(run: Run) -> dict[str, Any] | None:
    """The task that a run is of, as JSON's types; None where it is of none.

    'study': 'kwok1' or 'kwok2'. 'title': as in ``TaskScore``. 'from_step', 'from_s': the step and the time in s of its
    row before which it began. The others are those of the run's note: the polyps or labels, LPS mm, with their seed.

    Raises:
        InputError: a task that is damaged.
    """
    for module in TASKS:
        found: dict[str, Any] | None = import_module(module).task_told(run)
        if found is not None:
            return found
    return None


def begun_at(run: Run, step: int) -> dict[str, Any]:
    """The fields of ``task_told`` that say when a task began."""
    t = run.column("t")
    step = min(step, len(t))  # of a recording that was cut off
    again = step < len(t) and t[step] <= t[step - 1]  # its first step, or the first after a return to the start
    return {"from_step": step, "from_s": 0.0 if step == 0 or again else float(t[step - 1])}
