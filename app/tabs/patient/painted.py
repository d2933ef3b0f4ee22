"""Painted labels of the open case, listed."""

from __future__ import annotations

from app.cases.service import Case
from app.imaging.labels import PaintedDocument
from app.kit.errors import NotFound
from app.tabs.patient.sections import LabelEntry, LabelsSection, LabelState
from app.workspace.workspace import Workspace


class PaintedLabels:
    """Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._section: LabelsSection = {"items": []}
        self._of: str | None = None

    def section(self, fresh: bool) -> LabelsSection:
        """What the page lists; fresh: read from the store anew."""
        case_id = self._workspace.case.case_id
        if fresh or case_id != self._of:
            self._of = case_id
            self._section = {"items": [] if case_id is None else self._read(case_id)}
        return self._section

    def _read(self, case_id: str) -> list[LabelEntry]:
        services = self._workspace.services
        try:
            case = services.cases.get(case_id)
        except NotFound:
            return []
        return [self._entry(case, item) for item in services.labels.documents.list(case_id)]

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
