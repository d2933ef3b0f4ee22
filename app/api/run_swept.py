"""What the tool of a run has swept, and how near it has passed to bone, in one binary file."""

from __future__ import annotations

from fastapi import APIRouter, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.kit.errors import NotFound
from app.plans.model import NOTICE

router = APIRouter(prefix="/runs/{run_id}/swept", tags=["runs"], responses=ERRORS)


@router.post("", status_code=202)
def make_swept(run_id: Identifier, services: ServicesDep) -> JobPublic:
    """Make it as a job, of the run alone; one that was made before is read."""
    return JobPublic.of(services.swept_runs.start(run_id))


@router.get(
    "",
    response_class=Response,
    responses={
        200: {
            "content": {"application/octet-stream": {}},
            "description": "both surfaces, little-endian; docs/formats.md describes it",
        }
    },
)
def swept(run_id: Identifier, services: ServicesDep) -> Response:
    """The swept volume and the bone within reach of it, which `POST` makes; 404 until then."""
    data = services.swept_runs.known(run_id)
    if data is None:
        raise NotFound("the swept volume of this run is not made yet; POST makes it.")
    headers = {"X-Notice": NOTICE, "Cache-Control": "no-store"}
    return Response(data, media_type="application/octet-stream", headers=headers)
