"""The task of a drive on the page: what is chosen, and its progress for every client."""

from __future__ import annotations

from app.lumen.document import StoredRoute
from app.lumen.drive_options import LumenDriveOptions
from app.lumen.tasks import TaskChoice, TaskName
from app.messages.sections import Section
from app.tabs.drive import commands as c
from app.tabs.drive.sections import DriveTaskView
from app.tabs.drive.view import SnakeRecord
from app.workspace.task_view import moment_key, task_moment


def chosen_task(command: c.ChooseTask) -> TaskChoice | None:
    """What a client chooses."""
    if command.task is None:
        return None
    return TaskChoice(command.task, command.places, command.seed, command.count, command.hold_s)


def task_section(
    now: SnakeRecord, options: LumenDriveOptions, open_: bool, route: StoredRoute | None, offered: tuple[TaskName, ...]
) -> Section[object]:
    """The :class:`DriveTaskView`. open_: this client may choose; offered: in the open case."""
    chosen = options.task
    watch = None if now.prepared is None else now.prepared.task
    moment, words = (None, "") if watch is None else (watch.moment, watch.trouble)
    marks = 0 if route is None else sum(mark.kind == "polyp" for mark in route.content.marks)

    def build() -> DriveTaskView:
        choice = chosen or TaskChoice()
        return {
            "offered": list(offered),
            "task": None if chosen is None else chosen.task,
            "places": choice.places,
            "seed": choice.seed,
            "marks": marks,
            "open": open_,
            **task_moment(moment, words),
        }

    return Section((offered, chosen, marks, open_, words, moment_key(moment)), build)
