"""Registrations as documents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.documents import Ref, struct_kind
from app.registration.changes import changes
from app.registration.document import IDENTITY, SCHEMA, RegistrationContent, check_registration


def _with_sources(data: dict[str, Any]) -> dict[str, Any]:
    """What was stored before it was known how a registration was made: its transform was given with its pairs."""
    pairs = data.get("pairs")
    if isinstance(pairs, list) and all(isinstance(item, Mapping) for item in pairs):
        new = {"enabled": True, "weight": 1.0, "measured_from": "typed", "bead": ""}
        pairs = [{**item, "id": f"pair-{count}", **new} for count, item in enumerate(pairs, 1)]
    untouched = data.get("transform") == list(IDENTITY) and not pairs
    made_from = "none" if untouched else "given"
    return {**data, "pairs": pairs, "made_from": made_from}


def _with_words(data: dict[str, Any]) -> dict[str, Any]:
    """What was stored before it was kept what a transform's file says of it.

    A refined one could lose its touched points then; its transform stays, as one that nothing here was the source of.
    """
    lost = data.get("made_from") == "surface" and data.get("surface") is None
    return {**data, "made_from": "given"} if lost else data


def _refs(content: RegistrationContent) -> tuple[Ref, ...]:
    return () if content.surface is None else (Ref("structure", content.surface.structure),)


REGISTRATION = struct_kind(
    name="registration",
    noun="registration",
    schema=SCHEMA,
    content=RegistrationContent,
    rules=check_registration,
    refs=_refs,
    changed={1: _with_sources, 3: _with_words},
    changes=changes,
    undo_hint=("Take its newest edit back with POST /api/v1/registrations/{id}/undo, or delete it."),
)
