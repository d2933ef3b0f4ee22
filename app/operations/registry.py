"""The kinds of documents that are met from outside, one line each; routes, messages and verbs come from here."""

from __future__ import annotations

import importlib

from app.operations.spec import DocumentSpec

DOCUMENTS: list[str] = [
    "app.assignments.operations",
    "app.imaging.label_operations",
    "app.lumen.operations",
    "app.plans.operations",
    "app.registration.operations",
    "app.studies.operations",
]


def specs() -> tuple[DocumentSpec, ...]:
    """Every kind. Raises ValueError where two have one name."""
    found = tuple(importlib.import_module(module).SPEC for module in DOCUMENTS)
    names = [spec.kind.name for spec in found]
    if len(set(names)) < len(names):
        raise ValueError(f"two kinds of documents have one name: {', '.join(names)}")
    return found


def spec_named(name: str) -> DocumentSpec:
    """The kind of that name."""
    return next(spec for spec in specs() if spec.kind.name == name)
