"""Painted labels of the open case, listed."""

from __future__ import annotations

from app.cases.service import Case
from app.imaging.labels import PaintedDocument
from app.kit.kept import Same
from app.messages.sections import Section
from app.tabs.patient.sections import LabelEntry, LabelsSection, LabelState
from app.workspace.workspace import Workspace


class PaintedLabelList:
    """Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace

    def section(self) -> Section[LabelsSection]:
        """The list for the page."""
        case, services = self._workspace.case.case, self._workspace.services
        changes = services.store.changes.of(services.labels.documents.kind.name)
        return Section((Same(case), changes), lambda: {"items": [] if case is None else self._read(case)})

    def _read(self, case: Case) -> list[LabelEntry]:
        return [self._entry(case, item) for item in self._workspace.services.labels.documents.list(case.id)]

    def _entry(self, case: Case, item: PaintedDocument) -> LabelEntry:
        structure, changed = self._workspace.services.labels.structure(case, item)
        state: LabelState = "none" if structure is None else "changed" if changed else "made"
        return {
            "id": item.id,
            "name": item.name,
            "colour": item.content.colour,
            "volume": item.content.volume,
            "revision": item.revision,
            "locked": item.locked,
            "can_undo": item.can_undo,
            "can_redo": item.can_redo,
            "surface": state,
            "unreadable": item.unreadable,
        }
