"""Study on the server: which study is open, and the operations on it; driving is another tab's."""

from __future__ import annotations

from typing import Any

from app.documents import Document
from app.documents.editor import check_still_newest
from app.kit.kept import Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.operations.messages import OperationMessage
from app.operations.operation import Creation
from app.studies.content import LedStudy
from app.tabs.base import Tab
from app.tabs.study import SPEC, ShowStudy
from app.tabs.study.view import study_view
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError, VfixError

KIND = "study"


class StudyTab(Tab):
    """Owned by the session's thread. A study stays open whatever case is, since its trials may be of several."""

    spec = SPEC

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._studies = workspace.services.studies
        self._document: Document[LedStudy] | None = None

    @property
    def offered(self) -> bool:
        """Whether a study is open."""
        return self._document is not None

    def handle(self, command: ClientMessage) -> None:
        if isinstance(command, ShowStudy):
            self._open(command.study_id)

    def operate(self, message: OperationMessage) -> None:
        """Do an operation on the open study, or open the file of another one."""
        (operation,) = message.operations
        services = self.workspace.services
        if isinstance(operation, Creation):
            case_id = self.workspace.case.case_id
            if case_id is None:
                raise InputError("open a case first.")
            self._open(operation.perform(message.spec.context(services), case_id, "").id)
            return
        document = self._document
        if document is None:
            raise InputError("no study is open; open one first.")
        check_still_newest(message.revision, document.revision)
        try:
            operation.perform(message.spec.context(services, document.revision), "", document.id)
        finally:
            self._open(document.id)

    def _open(self, study_id: str | None) -> None:
        document = None if study_id is None else self._studies.documents.get(study_id)
        if document is not None and document.deleted_at is not None:
            raise InputError("that study is deleted; restore it first.")
        self._document = document
        self.workspace.opened.set(KIND, study_id)

    def subject(self) -> object:
        return self.workspace.services.store.changes.count, self.workspace.opened.id(KIND)

    def refresh(self) -> None:
        """Raises VfixError when the open study cannot be read any more; it is closed then."""
        try:
            self._open(self.workspace.opened.id(KIND))
        except VfixError:
            self._open(None)
            raise

    def sections(self) -> Sections:
        """The :class:`StudySections`."""
        document, stored = self._document, self.workspace.services.store.changes.count
        return {
            "study": Section(
                (Same(document), stored), lambda: None if document is None else study_view(document, self._studies)
            )
        }

    def hint(self) -> str:
        return "Do what is next, for one subject after another."
