"""Files of registrations: measured points as a table, transforms in and out."""

from dataclasses import replace
from functools import partial
from typing import Annotated, Any, cast, get_args
from urllib.parse import quote

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import ERRORS, ConditionDep, Identifier, ServicesDep
from app.api.uploads import form_of, receive_small, safe_name
from app.plans.imported_places import measured_notes
from app.plans.model import NOTICE
from app.registration.edits import edit, with_measured
from app.registration.files import (
    MEDIA_TYPES,
    TransformFormat,
    export_text,
    name_of,
    read_measured,
    read_transform,
)
from app.registration.public import RegistrationPublic
from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo

router = APIRouter(tags=["registrations"], responses=ERRORS)

MAX_BYTES = 1 << 20

_TABLE = form_of({"file": ".csv with columns label, x, y, z, its unit and frame"}, {}, frame=False)
_FIELDS: dict[str, str | dict[str, Any]] = {
    "name": "of the registration; else the file's",
    "to": {"type": "string", "enum": list(get_args(RegisteredTo)), "description": "where the file leaves it open"},
}
_TRANSFORM = form_of({"file": ".tfm of ITK, or .json"}, _FIELDS, frame=False)


@router.post("/registrations/{registration_id}/measured", openapi_extra=_TABLE)
async def read_points(
    registration_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Measured points of a table replace those that were measured before, by their labels or else in their order."""
    _, data, _ = await receive_small(request, MAX_BYTES, ())
    expected = condition.expected()

    def work() -> RegistrationPublic:
        points = read_measured(data, services.registrations.get(registration_id).content)
        done = edit(
            services.registrations, registration_id, partial(with_measured, points=points), expected_revision=expected
        )
        condition.tell(done.revision)
        doubts = measured_notes([point.position for point in points])
        return RegistrationPublic.of(replace(done, told=" ".join(doubts)))

    return await run_in_threadpool(work)


@router.post("/cases/{case_id}/registrations/import", status_code=201, openapi_extra=_TRANSFORM)
async def import_registration(
    case_id: Identifier, request: Request, services: ServicesDep, condition: ConditionDep
) -> RegistrationPublic:
    """Make a registration of a transform from the image to the patient, or to the robot's base where the file says so.

    A name that another registration of the case has gets a number.
    """
    file_name, data, fields = await receive_small(request, MAX_BYTES, ("name", "to"))

    def work() -> RegistrationPublic:
        services.cases.get(case_id)
        content = read_transform(file_name, data, _to(fields.get("to")))
        done = services.registrations.create(case_id, fields.get("name") or name_of(file_name), content, numbered=True)
        condition.tell(done.revision)
        return RegistrationPublic.of(done)

    return await run_in_threadpool(work)


@router.get(
    "/registrations/{registration_id}/export",
    response_class=Response,
    responses={200: {"content": {"application/json": {}, "text/plain": {}}, "description": "The file"}},
)
def export_registration(
    registration_id: Identifier, services: ServicesDep, form: Annotated[TransformFormat, Query(alias="format")] = "tfm"
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


def _to(word: str | None) -> RegisteredTo | None:
    if word not in (None, *get_args(RegisteredTo)):
        raise InputError(f"to is {word!r:.20}; say {' or '.join(get_args(RegisteredTo))}.")
    return cast(RegisteredTo | None, word)
