"""Registrations refined on a surface: touched points in, and the refinement as a job."""

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.registration_files import MAX_BYTES
from app.api.surface_models import RefineRequest, SurfaceTouchRequest
from app.api.uploads import form_of, receive_small
from app.registration.files import read_touched
from app.registration.public import RegistrationPublic

router = APIRouter(tags=["registrations"], responses=ERRORS)

_TABLE = form_of(
    {"file": ".csv with the columns x, y, z, its unit and its frame"},
    {"structure": "id of the structure; else that which the case is driven in"},
    frame=False,
)


@router.post("/registrations/{registration_id}/surface", openapi_extra=_TABLE)
async def read_surface(
    registration_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Points touched on a structure, of a table, replace those that were touched before."""
    _, data, fields = await receive_small(request, MAX_BYTES, ("structure",))
    expected = condition.expected()

    def work() -> RegistrationPublic:
        points = read_touched(data, services.registrations.get(registration_id).content)
        done = services.refining.set_touched(
            registration_id, points, "file", fields.get("structure"), expected_revision=expected
        )
        condition.tell(done.revision)
        return RegistrationPublic.of(done)

    return await run_in_threadpool(work)


@router.post("/registrations/{registration_id}/surface/touch", status_code=202)
def touch_surface(registration_id: Identifier, body: SurfaceTouchRequest, services: ServicesDep) -> JobPublic:
    """Touch a structure with a simulated pointer, for practice, as a job; what it touched is one edit."""
    return JobPublic.of(
        services.refining.start_touch(registration_id, body.structure, body.count, body.noise_mm, body.seed)
    )


@router.post("/registrations/{registration_id}/surface/refine", status_code=202)
def refine(registration_id: Identifier, body: RefineRequest, services: ServicesDep) -> JobPublic:
    """Move the touched points onto the structure as a job; the transform that is found is one edit."""
    return JobPublic.of(services.refining.start(registration_id, body.keep))
