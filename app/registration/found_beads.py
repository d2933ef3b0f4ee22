"""Beads that were found in the CT of a case, as a registration keeps them, and how they were looked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

from app.kit.names import check_stored_label, check_text
from app.kit.values import Position, check_id, check_position, number
from vfix_engine.errors import InputError

MAX_BEADS = 100
_MAX_CAUTION = 500  # characters


@dataclass(frozen=True)
class FoundBead:
    """A bead as it was found; LPS mm. diameter_mm: as measured. rejected: somebody says that it is none.

    name: of the bead that the case says is there, '' where it says nothing.
    """

    id: str
    position: Position
    diameter_mm: float
    peak_hu: float
    voxels: int
    rejected: bool = False
    name: str = ""


@dataclass(frozen=True)
class BeadSearchRecord:
    """What was looked for, and what the search says of its doubts, in sentences.

    diameter_mm: None for beads of every size. left_out: dense places of a bead's size that are none.
    """

    diameter_mm: float | None
    threshold_hu: float
    cautions: tuple[str, ...] = ()
    left_out: int = 0


def bead_label(bead: FoundBead) -> str:
    """What a bead is called, before it is confirmed and as a pair: as the case names it, else F and its number."""
    return bead.name or bead.id.replace("bead-", "F")


def check_beads(beads: tuple[FoundBead, ...]) -> tuple[FoundBead, ...]:
    """The beads, checked. Raises InputError."""
    if len(beads) > MAX_BEADS:
        raise InputError(f"{len(beads)} beads are too many; a registration keeps {MAX_BEADS} at most.")
    for bead in beads:
        check_id(bead.id, "a bead")
        check_stored_label(bead.name, "bead's name")
        check_position(bead.position)
        number(bead.diameter_mm, "a bead's diameter")
        number(bead.peak_hu, "a bead's brightness")
        if isinstance(bead.voxels, bool) or not isinstance(bead.voxels, int) or not isinstance(bead.rejected, bool):
            raise InputError("a bead has a count of voxels, and is rejected or not.")
    if len({bead.id for bead in beads}) < len(beads):
        raise InputError("two beads have the same identifier.")
    return beads


def bead_to_json(bead: FoundBead) -> dict[str, Any]:
    """Plain JSON values."""
    return {**asdict(bead), "position": list(bead.position)}


def bead_from_json(item: Any) -> FoundBead:
    """The inverse of `bead_to_json`. Raises InputError."""
    known = {field.name for field in fields(FoundBead)}
    if not isinstance(item, Mapping) or set(item) != known or not isinstance(item["position"], list):
        raise InputError(f"each bead of a registration has {', '.join(sorted(known))}.")
    bead = FoundBead(**{**item, "position": check_position(item["position"])})
    return check_beads((bead,))[0]


def search_to_json(search: BeadSearchRecord | None) -> dict[str, Any] | None:
    """Plain JSON values."""
    return None if search is None else {**asdict(search), "cautions": list(search.cautions)}


def search_from_json(item: Any) -> BeadSearchRecord | None:
    """The inverse of `search_to_json`. Raises InputError."""
    if item is None:
        return None
    known = {field.name for field in fields(BeadSearchRecord)}
    if not isinstance(item, Mapping) or set(item) != known or not isinstance(item["cautions"], list):
        raise InputError(f"the search for beads has {', '.join(sorted(known))}.")
    cautions = tuple(check_text(text, "cautions of the search", _MAX_CAUTION) for text in item["cautions"])
    if isinstance(item["left_out"], bool) or not isinstance(item["left_out"], int):
        raise InputError("how many places were left out is a count.")
    diameter = None if item["diameter_mm"] is None else number(item["diameter_mm"], "a bead's diameter")
    threshold = number(item["threshold_hu"], "the threshold")
    return BeadSearchRecord(diameter, threshold, cautions, item["left_out"])


def marked(beads: tuple[FoundBead, ...], bead_id: str, rejected: bool) -> tuple[FoundBead, ...]:
    """The beads with one of them rejected, or not."""
    return tuple(replace(bead, rejected=rejected) if bead.id == bead_id else bead for bead in beads)
