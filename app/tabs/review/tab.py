"""Review on the server: the scene it is looked at in, and the task of the run that is replayed.

Runs are read over REST, and the page itself moves what was driven.
"""

from __future__ import annotations

from typing import Any

from app.kit.kept import Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.tabs.base import Tab
from app.tabs.review import SPEC
from app.tabs.review.commands import ShowMoment
from app.tabs.review.task import ReplayedTask
from app.workspace.layers import Layer
from app.workspace.plan_items import plan_items
from app.workspace.workspace import Workspace


class ReviewTab(Tab):
    """Owned by the session's thread."""

    spec = SPEC
    first_view = "nose"

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._task = ReplayedTask(workspace)
        workspace.on_case_opened(lambda wanted: self._task.hide())

    def enter(self) -> None:
        """Open the anatomy along the path, as Rehearse shows it."""
        plan = self.workspace.plan.current
        self.workspace.case.open_up([] if plan is None else [item.position for item in plan_items(plan)])

    def leave(self) -> None:
        self._task.hide()

    def handle(self, command: ClientMessage) -> None:
        if isinstance(command, ShowMoment):
            self._task.show(command)

    def sections(self) -> Sections:
        """The :class:`ReviewSections`."""
        case = self.workspace.case
        return {
            "scope": Section((self.active, Same(case.case)), lambda: case.scope() if self.active else None),
            "replayed_task": self._task.section(),
        }

    def layers(self) -> list[Layer[Any]]:
        return self._task.layers() if self.active else []

    def hint(self) -> str:
        return "Space plays the chosen run; drag a plot to go through it."
