"""The task of the run that is replayed: its polyps or labels at the moment that is shown."""

from __future__ import annotations

from typing import Any

from app.kit.kept import Same
from app.messages.sections import Section
from app.tabs.review.commands import ShowMoment
from app.tabs.review.sections import ReplayedTaskView
from app.workspace.latest import BackgroundTask, Latest
from app.workspace.layers import Layer
from app.workspace.task_view import TaskMoment, moment_key, task_layers, task_moment
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError
from vfix_engine.study.lumen import TaskReplay

LANE = "review task"


class ReplayedTask:
    """Owned by the session's thread; the task of a run is computed on another one, once."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace, self._scores = workspace, workspace.services.run_scores
        self._latest = Latest(workspace.executor, workspace.post)
        self._shown = ShowMoment(type="review.moment", run=None)
        self._replay: TaskReplay | None = None
        self._failure = ""

    def show(self, command: ShowMoment) -> None:
        """Raises NotFound, and InputError for a run of another case than the open one."""
        run = command.run
        if run is not None and self._workspace.services.runs.get(run).case_id != self._workspace.case.case_id:
            raise InputError("that run is of another case; open that case first.")
        before, self._shown = self._shown.run, command
        if run == before:
            return
        self._replay, self._failure = None, ""
        self._latest.drop()
        if run is not None:
            self._ask(run)

    def hide(self) -> None:
        """Nothing is shown any more."""
        self.show(ShowMoment(type="review.moment", run=None))

    def _ask(self, run: str) -> None:
        def find(task: BackgroundTask) -> TaskReplay:
            return self._scores.task(run)

        self._latest.ask("The task of the run could not be read", find, self._found, self._failed, lane=LANE)

    def _found(self, replay: TaskReplay) -> None:
        self._replay = replay

    def _failed(self, words: str) -> None:
        self._failure = words

    @property
    def _moment(self) -> TaskMoment | None:
        return None if self._replay is None else self._replay.at(self._shown.t_s)

    def section(self) -> Section[object]:
        """The :class:`ReplayedTaskView`; None where no run is shown."""
        run, moment, failure = self._shown.run, self._moment, self._failure
        waits = self._replay is None and not failure

        def build() -> ReplayedTaskView | None:
            return None if run is None else {"run": run, "waits": waits, "words": failure, **task_moment(moment)}

        return Section((run, waits, failure, moment_key(moment)), build)

    def layers(self) -> list[Layer[Any]]:
        return task_layers(self._moment, Same(self._replay))
