"""Sections of the Review tab."""

from __future__ import annotations

from typing import TypedDict

from app.workspace.sections import ScopeSection
from app.workspace.task_sections import TaskMomentView


class ReplayedTaskView(TaskMomentView):
    """The task of the run that is replayed, at the moment that is shown; before it began it has neither of both.

    waits: it is being computed. words: why it is not known, '' where it is.
    """

    run: str
    waits: bool
    words: str


class ReviewSections(TypedDict):
    """The endoscope of a robot whose runs are replayed; None where the page makes one of the open plan.

    replayed_task: None where no run of a task is shown.
    """

    scope: ScopeSection | None
    replayed_task: ReplayedTaskView | None
