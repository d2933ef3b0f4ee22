"""Sections of the Patient step."""

from __future__ import annotations

from typing import TypedDict


class CaseEntry(TypedDict):
    """A case in the list."""

    id: str
    name: str
    created: str
    deleted: bool


class CasesSection(TypedDict):
    """All cases, the deleted ones included."""

    items: list[CaseEntry]


class PatientSections(TypedDict):
    """The cases to choose from."""

    cases: CasesSection
