"""Patient: which case is open, and which others there are."""

from __future__ import annotations

from typing import Any

from app.cases.kinds import kind_of
from app.exchange.patient_images import holds_images
from app.kit.kept import Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section, Sections
from app.store.changes import CASES
from app.tabs.base import Tab
from app.tabs.patient import SPEC
from app.tabs.patient import commands as c
from app.tabs.patient.hints import patient_hint
from app.tabs.patient.painted import PaintedLabelList
from app.tabs.patient.sections import CaseEntry, CasesSection
from app.tabs.patient.structures import Structures
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError


class PatientTab(Tab):
    """Opens, renames, deletes and restores cases; new ones come in by REST."""

    spec = SPEC

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        super().__init__(workspace, shared)
        self._structures = Structures(workspace)
        self._painted = PaintedLabelList(workspace)

    def handle(self, command: ClientMessage) -> None:
        """Raises InputError where the open case is to be deleted."""
        cases, workspace = self.workspace.services.cases, self.workspace
        match command:
            case c.ShowStructures() | c.ChangeStructure() | c.DeleteStructure():
                self._structures.handle(command)
            case c.RenameCase():
                cases.rename(command.case_id, command.name)
            case c.CaseCommand(type="case.open"):
                workspace.open_case(command.case_id)
            case c.CaseCommand(type="case.restore"):
                cases.restore(command.case_id)
            case c.CaseCommand() if command.case_id == workspace.case.case_id:
                raise InputError("the open case cannot be deleted; open another one first.")
            case c.CaseCommand():
                cases.delete(command.case_id)

    def subject(self) -> object:
        shown, services = self.workspace.case, self.workspace.services
        kinds = CASES, services.labels.documents.kind.name
        return Same(shown.case), shown.loading, services.store.changes.of(*kinds)

    def refresh(self) -> None:
        self._structures.refresh()

    def sections(self) -> Sections:
        """The :class:`PatientSections`."""
        return {
            "cases": Section(self.workspace.services.store.changes.of(CASES), self._list),
            "structures": self._structures.section(),
            "painted": self._painted.section(),
        }

    def _list(self) -> CasesSection:
        items: list[CaseEntry] = [
            {
                "id": case.id,
                "name": case.name,
                "created": str(case.created),
                "deleted": case.deleted_at is not None,
                "unreadable": case.unreadable,
                "images": holds_images(case),
            }
            for case in self.workspace.services.cases.list(include_deleted=True)
        ]
        return {"items": items}

    def layers(self) -> list[Layer[Any]]:
        return self._structures.layers()

    def hint(self) -> str:
        case = self.workspace.case.case
        return patient_hint(None if case is None else kind_of(case), bool(self.workspace.case.loading))
