"""Files of registrations: measured points as a table, transforms in and out."""

from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.api.registration_models import RegistrationPublic
from app.api.uploads import form_of, receive_small, safe_name
from app.services.plan_model import NOTICE
from app.services.registration_files import (
    MEDIA_TYPES,
    Format,
    export_text,
    name_of,
    read_measured,
    read_transform,
)

router = APIRouter(tags=["registrations"], responses=ERRORS)

MAX_BYTES = 1 << 20

_TABLE = form_of({"file": ".csv with the columns label, x, y, z, its unit and its frame"}, {}, frame=False)
_TRANSFORM = form_of({"file": ".tfm of ITK, or .json"}, {"name": "of the registration; else the file's"}, frame=False)


@router.post("/registrations/{registration_id}/measured", openapi_extra=_TABLE)
async def read_points(
    registration_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Measured points of a table replace those that were measured before, by their labels or else in their order."""
    _, data, _ = await receive_small(request, MAX_BYTES, ())
    expected = condition.expected()

    def work() -> RegistrationPublic:
        editor = services.registering.editor(registration_id)
        content = editor.document.content
        points = read_measured(data, content)
        done = editor.set_measured(points, expected_revision=expected)
        condition.tell(done.revision)
        return RegistrationPublic.of(done)

    return await run_in_threadpool(work)


@router.post("/cases/{case_id}/registrations/import", status_code=201, openapi_extra=_TRANSFORM)
async def import_registration(
    case_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Make a registration of a transform from the image to the patient."""
    file_name, data, fields = await receive_small(request, MAX_BYTES, ("name",))

    def work() -> RegistrationPublic:
        services.cases.get(case_id)
        content = read_transform(file_name, data)
        done = services.registrations.create(case_id, fields.get("name") or name_of(file_name), content)
        condition.tell(done.revision)
        return RegistrationPublic.of(done)

    return await run_in_threadpool(work)


@router.get(
    "/registrations/{registration_id}/export",
    response_class=Response,
    responses={200: {"content": {"application/json": {}, "text/plain": {}}, "description": "The file"}},
)
def export_registration(
    registration_id: Identifier, services: ServicesDep, form: Annotated[Format, Query(alias="format")] = "tfm"
) -> Response:
    """The transform as ITK's .tfm or as JSON. Not for clinical use."""
    document = services.registrations.get(registration_id)
    plain, full = safe_name(document.name), quote(document.name, safe="")
    disposition = f"attachment; filename=\"{plain}.{form}\"; filename*=UTF-8''{full}.{form}"
    return Response(
        export_text(document, form),
        media_type=MEDIA_TYPES[form],
        headers={"Content-Disposition": disposition, "X-Notice": NOTICE, "Cache-Control": "no-store"},
    )
