"""What an endoscope sees of a lumen: its wall from inside, in one binary file."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Header, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.endoscope import FILE_RESPONSES, file_response
from app.api.jobs import JobPublic

router = APIRouter(prefix="/cases/{case_id}/endoscope", tags=["pictures"], responses=ERRORS)


@router.post("", status_code=202)
def make_lumen_endoscope(case_id: Identifier, services: ServicesDep) -> JobPublic:
    """Make the wall of a lumen as a job; one that was made before is taken."""
    return JobPublic.of(services.lumen_endoscope.start(case_id))


@router.get("", response_class=Response, responses=FILE_RESPONSES)
def lumen_endoscope(
    case_id: Identifier,
    services: ServicesDep,
    if_none_match: Annotated[str | None, Header(description="the ETag of a file that is there already")] = None,
) -> Response:
    """The wall of a lumen from inside, which `POST` makes; 404 until then."""
    return file_response(services.lumen_endoscope.known(case_id), if_none_match)
