"""Study on the server: which study is open, the operations on it, and the runs that become its trials; driving is
another tab's.
"""

from __future__ import annotations

from typing import Any

from app.documents import Document
from app.documents.editor import check_still_newest
from app.kit.errors import NotFound
from app.kit.kept import Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.operations.messages import OperationMessage
from app.operations.operation import Creation
from app.studies.content import LedStudy
from app.studies.course import course_of, running_of
from app.studies.operations import SPEC as STUDIES
from app.studies.operations import AttachRun
from app.tabs.base import Tab
from app.tabs.study import SPEC, ShowStudy
from app.tabs.study.view import study_hint, study_view
from app.workspace.fixed_drive import FixedDrive
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
        self._looked: object = None  # jobs and study, as they were when a run was looked for last
        self._refused = ""  # why the newest run is not the trial

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
        self.workspace.fixed = self._fixed()

    # -- a trial that goes on

    def _fixed(self) -> FixedDrive | None:
        """How it is driven, which nobody changes meanwhile. Raises VfixError where its plan or route is gone."""
        document = self._document
        led = None if document is None else running_of(document.content)
        if document is None or led is None:
            return None
        place = next(one for one in course_of(document.content, led.subject) if one.led == led)
        driven = self._studies.driven(document.content.text, place.condition)
        return FixedDrive(driven.document_id, driven.how)

    def tick(self) -> bool:
        """A run that was stored becomes the trial that goes on, also one that was stored while no page was there."""
        document = self._document
        led = None if document is None else running_of(document.content)
        if document is None or led is None:
            return False
        looked = self.workspace.services.jobs.going_on()[0], led
        if looked == self._looked:
            return False
        self._looked = looked
        return self._attach(document, led.subject)

    def _attach(self, document: Document[LedStudy], subject: str) -> bool:
        """Whether a run is the trial now; why one is not is told once."""
        context = STUDIES.context(self.workspace.services, document.revision)
        try:
            AttachRun(subject=subject).perform(context, "", document.id)
        except NotFound:  # nobody has finished one yet
            return False
        except VfixError as error:
            if str(error) != self._refused:
                self._refused = str(error)
                self.workspace.note(self._refused, error=True)
            return False
        self._refused = ""
        self._open(document.id)
        return True

    # -- what the page shows

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
        document = self._document
        return "" if document is None else study_hint(document.content)
