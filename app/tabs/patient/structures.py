"""Imported structures of the open case: listed, shown and hidden, changed in the store, drawn in the scene."""

from __future__ import annotations

from typing import Any

from app.cases.service import Case
from app.cases.structures import Structure
from app.kit.kept import Same
from app.messages.fields import ClientMessage
from app.messages.sections import Section
from app.scene.structures import StructureNodes, StructureShape
from app.tabs.patient import commands as c
from app.tabs.patient.sections import StructureEntry, StructuresSection
from app.workspace.background import in_background
from app.workspace.layers import Layer
from app.workspace.workspace import Workspace
from vfix_engine.anatomy.labels.surfaces import for_display
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh

SHOWN_AT_FIRST = 24  # structures of a case; more cannot be distinguished, and take their time
DISPLAY_TRIANGLES = 40_000  # of a structure
_COLOUR = "#9f9f9f"


class Structures:
    """Owned by the session's thread; surfaces are read in the background."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._case: Case | None = None
        self._chosen: dict[str, bool] = {}  # visibility of structures that were shown or hidden explicitly
        self._meshes: dict[str, TriangleMesh] = {}
        self._reading: set[str] = set()

    def handle(self, command: ClientMessage) -> None:
        """Answer one of the structures' commands. Raises InputError and NotFound."""
        case_id, stored = self._workspace.case.case_id, self._workspace.services.structures
        if case_id is None:
            raise InputError("no head is open.")
        match command:
            case c.ShowStructures():
                ids = [item.id for item in self._spared()] if command.structure_id is None else [command.structure_id]
                self._chosen |= dict.fromkeys(ids, command.shown)
                self._hide_outlines()  # before the section of the case is made, which the slices use
            case c.ChangeStructure():
                stored.change(case_id, command.structure_id, name=command.name, colour=command.colour)
            case c.DeleteStructure():
                stored.delete(case_id, command.structure_id)

    def refresh(self) -> None:
        """Request the surfaces to be shown of the open case, and set those that the slices omit."""
        self._case = self._workspace.case.case
        self._forget_others()
        self._read()
        self._hide_outlines()

    def section(self) -> Section[StructuresSection]:
        """The list for the page."""
        case = self._case
        return Section(
            (Same(case), tuple(self._chosen.items())),
            lambda: {"items": [self._entry(case, item) for item in self._spared()] if case else []},
        )

    def _hide_outlines(self) -> None:
        self._workspace.case.hidden = frozenset(item.id for item in self._spared() if not self._is_shown(item))

    def layers(self) -> list[Layer[Any]]:
        """The structures that are shown, and those that were shown and are hidden now."""
        shapes = [
            StructureShape(item.id, item.colour or _COLOUR, self._is_shown(item), self._meshes[item.id])
            for item in self._spared()
            if item.id in self._meshes
        ]
        if not shapes:
            return []
        key = tuple((shape.id, shape.colour, shape.shown) for shape in shapes)
        case_id = self._workspace.case.case_id
        return [Layer("patient.structures", key, StructureNodes, lambda nodes: nodes.show(shapes), made_for=case_id)]

    def _spared(self) -> tuple[Structure, ...]:
        return () if self._case is None else self._case.protectable

    def _is_shown(self, item: Structure) -> bool:
        at_first = len(self._spared()) <= SHOWN_AT_FIRST
        return self._chosen.get(item.id, at_first)

    def _entry(self, case: Case, item: Structure) -> StructureEntry:
        triangles = next(surface.triangles for surface in case.surfaces if surface.name == item.surface)
        return {
            "id": item.id,
            "name": item.name,
            "colour": item.colour or _COLOUR,
            "shown": self._is_shown(item),
            "triangles": triangles,
            "notes": list(item.notes),
            "origin": item.provenance.origin,
        }

    def _forget_others(self) -> None:
        known = {item.id for item in self._spared()}
        self._meshes = {key: mesh for key, mesh in self._meshes.items() if key in known}
        self._chosen = {key: shown for key, shown in self._chosen.items() if key in known}
        self._reading &= known

    def _read(self) -> None:
        """Read the surfaces that have to be shown and are not loaded yet."""
        case = self._case
        if case is None or self._workspace.case.loading:
            return
        for item in case.protectable:
            if self._is_shown(item) and item.id not in self._meshes and item.id not in self._reading:
                self._reading.add(item.id)
                self._read_one(case.id, item.id)

    def _read_one(self, case_id: str, structure_id: str) -> None:
        def read() -> None:
            mesh = for_display(self._workspace.services.cases.structure_mesh(case_id, structure_id), DISPLAY_TRIANGLES)
            self._workspace.post(lambda: self._loaded(structure_id, mesh))

        def failed(words: str) -> None:
            self._workspace.post(lambda: self._workspace.note(words, True))

        in_background(self._workspace.executor, "A structure cannot be shown", read, failed)

    def _loaded(self, structure_id: str, mesh: TriangleMesh) -> None:
        if structure_id in self._reading:
            self._reading.discard(structure_id)
            self._meshes[structure_id] = mesh
