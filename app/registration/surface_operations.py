"""What can be done to the points that were touched on a surface; their tables and the jobs have routes of their own."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from msgspec import Meta

from app.operations.operation import Change, Edit
from app.registration.document import RegistrationContent, StoredRegistration
from app.registration.fit_report import refitted
from app.registration.operation_base import Registrations
from app.registration.tracked_tip import LONGEST_S
from vfix_engine.errors import InputError

StructureId = Annotated[str, Meta(min_length=1, max_length=64)]


class TrackSurface(Change, frozen=True):
    """Take what the tracked pointer was stroked over in the last `seconds`, one place for every millimetre.

    `structure`: null for that which the case is driven in.
    """

    rest = "POST /registrations/{id}/surface/tracked"
    seconds: Annotated[float, Meta(gt=0.0, le=LONGEST_S)]
    structure: StructureId | None = None

    def run(self, context: Registrations, document_id: str) -> StoredRegistration:
        touch = context.service.refining.touch_tracked
        return touch(document_id, self.seconds, self.structure, expected_revision=context.expected)


class ForgetSurface(Edit, frozen=True):
    """Forget the touched points; a refined transform goes back to the fit of the points, where they can be fitted."""

    rest = "DELETE /registrations/{id}/surface"

    def apply(self, content: RegistrationContent, context: Registrations) -> RegistrationContent:
        bare = replace(content, surface=None)
        if content.made_from != "surface":
            return bare
        back = refitted(replace(bare, made_from="none"))
        if back.made_from == "none":
            raise InputError(
                "the registration has only these touched points; take the refinement back with undo, or touch others."
            )
        return back


SURFACES = (TrackSurface, ForgetSurface)
