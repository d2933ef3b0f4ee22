"""Registrations as documents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.documents import DocumentKind, Ref
from app.registration.changes import changes
from app.registration.document import (
    IDENTITY,
    RegistrationContent,
    check_registration,
    registration_from_json,
    registration_to_json,
)

SCHEMA = "vfix-registration/4"
BEFORE_WORDS = "vfix-registration/3"
BEFORE_CALIBRATIONS = "vfix-registration/2"
BEFORE_SOURCES = "vfix-registration/1"


def _with_sources(data: dict[str, Any]) -> dict[str, Any]:
    """What was stored before it was known how a registration was made: its transform was given with its pairs."""
    pairs = data.get("pairs")
    if isinstance(pairs, list) and all(isinstance(item, Mapping) for item in pairs):
        new = {"enabled": True, "weight": 1.0, "measured_from": "typed", "bead": ""}
        pairs = [{**item, "id": f"pair-{count}", **new} for count, item in enumerate(pairs, 1)]
    untouched = data.get("transform") == list(IDENTITY) and not pairs
    made_from = "none" if untouched else "given"
    return {**data, "pairs": pairs, "made_from": made_from, "fle_mm": None, "beads": [], "search": None}


def _with_calibrations(data: dict[str, Any]) -> dict[str, Any]:
    """What was stored before surfaces were touched and pointers calibrated."""
    return {**data, "surface": None, "pointer": None, "robot": None}


def _with_words(data: dict[str, Any]) -> dict[str, Any]:
    """What was stored before it was kept what a transform's file says of it.

    A refined one could lose its touched points then; its transform stays, as one that nothing here was the source of.
    """
    lost = data.get("made_from") == "surface" and data.get("surface") is None
    return {**data, "said": None, **({"made_from": "given"} if lost else {})}


def _refs(content: RegistrationContent) -> tuple[Ref, ...]:
    return () if content.surface is None else (Ref("structure", content.surface.structure),)


REGISTRATION = DocumentKind(
    name="registration",
    noun="registration",
    schema=SCHEMA,
    empty=RegistrationContent,
    read=registration_from_json,
    write=registration_to_json,
    check=check_registration,
    refs=_refs,
    upgrades={
        BEFORE_SOURCES: (BEFORE_CALIBRATIONS, _with_sources),
        BEFORE_CALIBRATIONS: (BEFORE_WORDS, _with_calibrations),
        BEFORE_WORDS: (SCHEMA, _with_words),
    },
    changes=changes,
    undo_hint=("Take its newest edit back with POST /api/v1/registrations/{id}/undo, or delete it."),
)
