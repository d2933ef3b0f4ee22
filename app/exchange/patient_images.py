"""Images identify their patient, if only by the face; exports contain them only on request (HAZ-34)."""

from __future__ import annotations

from app.cases.kinds import kind_of
from app.cases.model import HEAD_PHANTOM, Case
from vfix_engine.errors import InputError

FACE_WARNING = "This is the patient’s face: a screenshot of it can identify them."
WITH_IMAGES = "confirms that the patient's images are exported"  # description of the option of REST


def image_warning(case: Case) -> str:
    """What is told of a case that has images."""
    kind = kind_of(case)
    return f"Images of a {kind.noun} can identify the patient: {kind.identifies}. Exports that hold them ask first."


def holds_images(case: Case) -> bool:
    """Return whether an export with all volumes of a case can identify a patient; the synthetic head cannot."""
    return case.id != HEAD_PHANTOM and bool(case.volumes or case.overlays)


def check_images(case: Case, confirmed: bool, how: str) -> None:
    """Raise InputError for an export with voxels that was not confirmed. how: the option that confirms it."""
    if holds_images(case) and not confirmed:
        raise InputError(
            f"this export holds the {kind_of(case).noun}'s images, which can identify the patient: "
            f"{kind_of(case).identifies}. Add {how} to write it all the same."
        )
