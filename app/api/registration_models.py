"""Models of registrations in the API."""

from __future__ import annotations

from pydantic import BaseModel

from app.api.dependencies import Number, RequestBody
from app.registration.fit_report import FleSource
from app.registration.public import Length
from app.registration.service import PlanRegistration, UseState
from app.registration.target_errors import ErrorAlongPath, ErrorAtTarget, ErrorTable
from vfix_engine.registration.beads import THRESHOLD_HU


class BeadsRequest(RequestBody):
    """What to look for in the CT; a diameter of null finds beads of every size."""

    diameter_mm: Number | None = None
    threshold_hu: Number = THRESHOLD_HU


class ErrorTablePublic(BaseModel):
    """The error to be expected at a plan's targets and along its chosen path, and what that means or why it is open."""

    fle_mm: Length
    fle_source: FleSource
    targets: list[ErrorAtTarget]
    path: ErrorAlongPath | None
    words: str

    @classmethod
    def of(cls, table: ErrorTable) -> ErrorTablePublic:
        return cls.model_validate(table, from_attributes=True)


class PlanRegistrationPublic(BaseModel):
    """The registration that a plan refers to: 'ready', or why it cannot be used, with words; null without any.

    doubts: of one that is ready, what to know before it is gone by, such as a point that does not fit the others.
    """

    plan_id: str
    registration: str | None
    name: str | None
    state: UseState
    words: str
    doubts: tuple[str, ...]
    errors: ErrorTablePublic | None

    @classmethod
    def of(cls, plan_id: str, used: PlanRegistration, errors: ErrorTable | None) -> PlanRegistrationPublic:
        name = None if used.document is None else used.document.name
        table = None if errors is None else ErrorTablePublic.of(errors)
        return cls(
            plan_id=plan_id, registration=used.id, name=name, state=used.state, words=used.words, doubts=used.doubts,
            errors=table,
        )  # fmt: skip
