"""Painted labels of the open case: listed, and changed in the store."""

from __future__ import annotations

from app.cases.service import Case
from app.imaging.labels import PaintedDocument
from app.kit.kept import Same
from app.messages.fields import Command
from app.messages.sections import Section
from app.tabs.patient import paint_commands as c
from app.tabs.patient.sections import LabelEntry, LabelsSection, LabelState
from app.workspace.workspace import Workspace
from vfix_engine.anatomy.labels.painting import Stroke
from vfix_engine.errors import InputError


class PaintedLabels:
    """Owned by the session's thread."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace

    def handle(self, command: Command) -> None:
        """Answer one of the labels' commands. Raises InputError, NotFound and what a locked label raises."""
        case_id, labels = self._workspace.case.case_id, self._workspace.services.labels
        if case_id is None:
            raise InputError("no head is open.")
        match command:
            case c.NewLabel():
                labels.create(case_id, command.name, structure_id=command.structure_id)
            case c.DrawStroke():
                stroke = Stroke(command.mode, command.brush, command.radius_mm, command.points, command.normal)
                labels.stroke(command.label_id, stroke)
            case c.LabelStep(type="label.undo"):
                labels.documents.editor(command.label_id).undo()
            case c.LabelStep(type="label.redo"):
                labels.documents.editor(command.label_id).redo()
            case c.LabelStep(type="label.delete"):
                labels.documents.delete(command.label_id)
            case c.LabelStep():
                labels.documents.restore(command.label_id)
            case c.ChangeLabel():
                self._change(command)

    def section(self) -> Section[LabelsSection]:
        """What the page lists."""
        case, services = self._workspace.case.case, self._workspace.services
        changes = services.store.changes.of(services.labels.documents.kind.name)
        return Section((Same(case), changes), lambda: {"items": [] if case is None else self._read(case)})

    def _change(self, command: c.ChangeLabel) -> None:
        labels, label_id = self._workspace.services.labels, command.label_id
        if command.name is not None:
            labels.documents.rename(label_id, command.name)
        if command.colour is not None:
            labels.recolour(label_id, command.colour)
        if command.locked is not None:
            labels.documents.editor(label_id).set_locked(command.locked)

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
