"""Sections of the Patient tab."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.cases.structures import StructureOrigin


class CaseEntry(TypedDict):
    """A case in the list. unreadable: why its content cannot be read, '' where it can.

    images: it has images that can identify its patient.
    """

    id: str
    name: str
    created: str
    deleted: bool
    unreadable: str
    images: bool


class CasesSection(TypedDict):
    """All cases, the deleted ones included."""

    items: list[CaseEntry]


class StructureEntry(TypedDict):
    """A structure beside the anatomy of the open case.

    colour: '#rrggbb'. notes: doubts about it, in sentences. origin: 'ct' for a threshold, 'painted' for a
    label, 'segmentation' for a file.
    """

    id: str
    name: str
    colour: str
    shown: bool
    triangles: int
    notes: list[str]
    origin: StructureOrigin


class StructuresSection(TypedDict):
    """The imported structures of the open case."""

    items: list[StructureEntry]


LabelState = Literal["none", "made", "changed"]


class LabelEntry(TypedDict):
    """A painted label of the open case.

    volume: the one whose grid it has. surface: whether a structure was made from it, and still has the surface of what
    is painted. unreadable: why its content cannot be read, '' where it can.
    """

    id: str
    name: str
    colour: str
    volume: str
    revision: int
    locked: bool
    can_undo: bool
    can_redo: bool
    surface: LabelState
    unreadable: str


class LabelsSection(TypedDict):
    """The painted labels of the open case."""

    items: list[LabelEntry]


class PatientSections(TypedDict):
    """The cases to choose from, and the structures and painted labels of the open one."""

    cases: CasesSection
    structures: StructuresSection
    painted: LabelsSection
