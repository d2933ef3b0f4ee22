"""Beads that were found in the CT of a case, as a registration keeps them, and how they were looked for."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.kit.names import check_stored_label, check_text
from app.operations.fields import Place, StoredId
from vfix_engine.errors import InputError

MAX_BEADS = 100
_MAX_CAUTION = 500  # characters


@dataclass(frozen=True)
class FoundBead:
    """A bead as it was found; LPS mm. diameter_mm: as measured. rejected: somebody says that it is none.

    name: of the bead that the case says is there, '' where it says nothing.
    """

    id: StoredId
    position: Place
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


def check_beads(beads: tuple[FoundBead, ...], search: BeadSearchRecord | None) -> None:
    """Raises InputError for names and cautions that cannot be shown, and for two beads of one identifier."""
    for bead in beads:
        check_stored_label(bead.name, "bead's name")
    for text in () if search is None else search.cautions:
        check_text(text, "cautions of the search", _MAX_CAUTION)
    if len({bead.id for bead in beads}) < len(beads):
        raise InputError("two beads have the same identifier.")


def marked(beads: tuple[FoundBead, ...], bead_id: str, rejected: bool) -> tuple[FoundBead, ...]:
    """The beads with one of them rejected, or not."""
    return tuple(replace(bead, rejected=rejected) if bead.id == bead_id else bead for bead in beads)
