"""How each kind of case is called and shown: what differs between them on the page is declared here."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from app.cases.model import CAVITY, Case
from app.cases.structures import CaseKind

# Parts of the Patient tab's panel that only some kinds have.
PatientPart = Literal["structures", "threshold", "paint", "overlays", "lumen"]


@dataclass(frozen=True)
class KindSpec:
    """A kind of case on the page.

    noun: in messages. then: the tab that comes after Patient. surface: its anatomy in the scene, in one word.
    anatomy: the same within a sentence. opacity: of that surface when a case is opened, from 0 to 1; less than 1 where
    a person looks into it.
    parts: of the Patient tab's panel, beside the list of cases and the import. sliced: it has slices, or a place for
    them, even without a CT.
    scope: how its anatomy looks through a camera within it; None where an endoscope sees the air about a plan's path.
    covers: what an error of its surface means for whoever drives there. identifies: why its images tell of a patient.
    """

    noun: str
    then: str
    surface: str
    anatomy: str
    opacity: float
    parts: tuple[PatientPart, ...]
    sliced: bool
    covers: str
    identifies: str
    scope: Literal["colon"] | None = None


KINDS: dict[CaseKind, KindSpec] = {
    "head": KindSpec(
        "head", "Plan", "Bone", "bone", 1.0, ("structures", "threshold", "paint", "overlays"), True,
        "the margin has to cover that", "a face can be drawn from them",
    ),
    "lumen": KindSpec(
        "lumen", "Route", "Wall", "the wall", 0.3, ("lumen",), False,
        "the certificate knows that surface alone", "they show the body", "colon",
    ),
}  # fmt: skip


_CAVITY = replace(KINDS["lumen"], noun="cavity")  # driven in like any lumen, and called what it is


def is_cavity(case: Case) -> bool:
    """Whether a case is the body cavity."""
    return any(surface.source == CAVITY for surface in case.surfaces)


def kind_of(case: Case) -> KindSpec:
    """How a case is called and shown."""
    return _CAVITY if is_cavity(case) else KINDS[case.kind]


def uncertainty_words(case: Case) -> str:
    """How far the anatomy of a case may lie off its surface, and what that means; '' where nothing is to be said."""
    kind = kind_of(case)
    words = case.uncertainty.words(kind.anatomy)
    return f"{words}; {kind.covers}" if words else ""
