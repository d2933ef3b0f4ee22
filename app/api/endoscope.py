"""What an endoscope sees along the path of a plan: the surface of the air about it, in one binary file."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Header, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.imaging.endoscope import EndoscopeSurface
from app.imaging.endoscope_file import EndoscopeFile
from app.kit.errors import NotFound
from app.planning.bone_removal import removal_solids
from app.plans.model import NOTICE

FILE_RESPONSES: dict[int | str, dict[str, Any]] = {
    200: {
        "content": {"application/octet-stream": {}},
        "description": "mesh with normals, colours and clusters, little-endian; docs/formats.md describes it",
    },
    304: {"description": "the file that If-None-Match names is still the present one"},
}

router = APIRouter(prefix="/plans/{plan_id}/endoscope", tags=["pictures"], responses=ERRORS)


@router.post("", status_code=202)
def make_endoscope(plan_id: Identifier, services: ServicesDep) -> JobPublic:
    """Make the surface as a job; one that was made before is read."""
    return JobPublic.of(_surface(plan_id, services).start(services.plans.get(plan_id).case_id))


@router.get(
    "",
    response_class=Response,
    responses=FILE_RESPONSES,
)
def endoscope(
    plan_id: Identifier,
    services: ServicesDep,
    if_none_match: Annotated[str | None, Header(description="the ETag of a file that is there already")] = None,
) -> Response:
    """The surface of air against tissue about path and targets, which `POST` makes; 404 until then."""
    file = _surface(plan_id, services).known(services.cases.get(services.plans.get(plan_id).case_id))
    if file is None:
        raise NotFound("what an endoscope sees of this plan is not made yet; POST makes it.")
    return file_response(file, if_none_match)


def file_response(file: EndoscopeFile, if_none_match: str | None) -> Response:
    """The file, unless the client has it."""
    headers = {
        "ETag": f'"{file.revision}"',
        "X-Notice": NOTICE,
        "Cache-Control": "no-store",  # a browser's cache lies on its disk and outlives the planner
    }
    if if_none_match == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    return Response(file.data, media_type="application/octet-stream", headers=headers)


def _surface(plan_id: str, services: ServicesDep) -> EndoscopeSurface:
    plan = services.plans.get(plan_id)
    places = [item.position for item in (*plan.content.points, *plan.content.targets)]
    return services.endoscope.about(plan.case_id, places, removal_solids(plan))
