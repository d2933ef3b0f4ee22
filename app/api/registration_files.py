"""Files of registrations: measured points as a table."""

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.api.registration_models import RegistrationPublic
from app.api.uploads import form_of, receive_small
from app.services.registration_files import read_measured

router = APIRouter(tags=["registrations"], responses=ERRORS)

MAX_BYTES = 1 << 20

_TABLE = form_of({"file": ".csv with the columns label, x, y, z, its unit and its frame"}, {}, frame=False)


@router.post("/registrations/{registration_id}/measured", openapi_extra=_TABLE)
async def read_points(
    registration_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Measured points of a table replace those that were measured before, by their labels or else in their order."""
    _, data, _ = await receive_small(request, MAX_BYTES, ())
    expected = condition.expected()

    def work() -> RegistrationPublic:
        editor = services.registering.editor(registration_id)
        points = read_measured(data, editor.document.content.to)
        done = editor.set_measured(points, expected_revision=expected)
        condition.tell(done.revision)
        return RegistrationPublic.of(done)

    return await run_in_threadpool(work)
