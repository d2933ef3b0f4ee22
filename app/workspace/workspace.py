"""The state that the tabs of one client share."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from typing import Any

from app.kit.values import Position
from app.messages.client import Client
from app.messages.fields import ClientMessage
from app.operations.messages import OperationMessage
from app.services import Services
from app.workspace import commands as c
from app.workspace.camera_view import CameraView
from app.workspace.case_view import CaseView
from app.workspace.fixed_drive import FixedDrive
from app.workspace.open_plan import OpenedPlan
from app.workspace.opened import OpenedDocuments
from vfix_engine.errors import InputError

__all__ = ["Position", "Request", "Workspace"]

Request = Callable[[], None]


class Workspace:
    """The open case and plan, the camera, and the notes and requests of the client. Owned by the session's thread.

    client: who it is and its role. post: queues a request onto the session's thread; may be called on any.
    note: words for the user, and whether they are an error.
    """

    def __init__(
        self,
        client: Client,
        services: Services,
        executor: Executor,
        post: Callable[[Request], Any],
        note: Callable[[str, bool], None] = lambda words, error: None,
    ) -> None:
        self.client, self.services, self.executor, self.post, self._note = client, services, executor, post, note
        self.case = CaseView(services, executor, post)
        self.camera = CameraView(self.case)
        self.plan = OpenedPlan()
        self.opened = OpenedDocuments()  # of other kinds
        self.fixed: FixedDrive | None = None  # by a trial that goes on
        self._case_listeners: list[Callable[[str | None], None]] = []

    def note(self, words: str, error: bool = False) -> None:
        """Show the user a note; empty words show none."""
        if words:
            self._note(words, error)

    def on_case_opened(self, listener: Callable[[str | None], None]) -> None:
        """Call ``listener`` with the id of the plan to open when a case was opened."""
        self._case_listeners.append(listener)

    def open_first(self, case_id: str | None, plan_id: str | None) -> None:
        """Open the case that a client remembers, or an available one."""
        self.case.open_first(case_id)
        self._case_opened(plan_id)

    def open_case(self, case_id: str) -> None:
        """Open a case and the newest of its plans. Raises VfixError where there is no such case."""
        self.case.open(case_id)
        self._case_opened(None)

    def _case_opened(self, plan_id: str | None) -> None:
        for listener in self._case_listeners:
            listener(plan_id)

    def operate(self, message: OperationMessage) -> None:
        """Do an operation on a document of the open case. Raises VfixError."""
        if self.case.case_id is None:
            raise InputError("no case is open.")
        message.perform(message.spec.context(self.services, message.revision), self.case.case_id)

    def handle(self, command: ClientMessage) -> Any:
        """Answer a command for what all tabs share."""
        match command:
            case c.SetCamera():
                self.camera.look_from(command.view)
            case c.LabelsByPage():
                self.camera.leave_labels_to_page(command.by_page)
            case c.Project():
                return self.camera.project(command.points)
            case _:
                self.case.handle(command)
        return None
