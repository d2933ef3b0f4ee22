"""Openings of the airway to the outside, at which a path can begin."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.imaging.openings import Opening, OpeningSide
from app.kit.values import Position

router = APIRouter(prefix="/cases/{case_id}/openings", tags=["cases"], responses=ERRORS)


class OpeningPublic(BaseModel):
    """A nostril: the largest ball of air in it. LPS, mm; side: of the patient, '' where the CT does not tell."""

    id: str
    name: str
    side: OpeningSide
    position: Position
    inward: Position
    radius_mm: float

    @classmethod
    def of(cls, opening: Opening) -> OpeningPublic:
        return cls(**vars(opening), name=opening.name)


@router.get("")
def list_openings(case_id: Identifier, services: ServicesDep) -> list[OpeningPublic]:
    """The nostrils in the CT of a head, the right one first; none where the CT does not show them.

    They are looked for once, which takes some seconds, and kept; as a job by `POST`.
    """
    return [OpeningPublic.of(one) for one in services.openings.make(case_id).items]


@router.post("", status_code=202)
def find_openings(case_id: Identifier, services: ServicesDep) -> JobPublic:
    """Look for the nostrils as a job, unless they are known; its result is the id of the case."""
    return JobPublic.of(services.openings.start(case_id))
