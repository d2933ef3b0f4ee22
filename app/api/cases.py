"""Cases: list, import, show, rename, delete and restore."""

from typing import Annotated, Any

from fastapi import APIRouter, Query, Request

from app.api.case_models import CasePublic, CaseUpdate
from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.uploads import receive
from app.services.importing import ImportRequest

router = APIRouter(prefix="/cases", tags=["cases"], responses=ERRORS)

MAX_CASE_BYTES = 2 << 30  # [byte] of a case's file (HAZ-30)
_FORM: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {
                        "file": {"type": "string", "format": "binary", "description": "CT volume or bone surface"},
                        "name": {"type": "string", "description": "of the case; else the file's"},
                        "frame": {"type": "string", "enum": ["LPS", "RAS"], "description": "where the file names none"},
                        "units": {"type": "string", "enum": ["mm", "m"], "description": "where the file names none"},
                    },
                }
            }
        },
    }
}


@router.get("")
def list_cases(services: ServicesDep, include_deleted: Annotated[bool, Query()] = False) -> list[CasePublic]:
    """Every case, oldest first."""
    return [CasePublic.of(case) for case in services.cases.list(include_deleted)]


@router.post("", status_code=202, openapi_extra=_FORM)
async def import_case(request: Request, services: ServicesDep) -> JobPublic:
    """Upload a head; the answer is a job to watch, whose result is the case's id.

    A file that names neither frame nor unit is not guessed at: its job fails with `frame_error` and says what to name.
    The file is kept meanwhile: `POST /api/jobs/{job_id}/answer` imports it without another upload.
    """
    upload = await receive(request, services.store.scratch, MAX_CASE_BYTES, ("name", "frame", "units"))
    told = upload.fields
    wanted = ImportRequest(upload.path, name=told.get("name"), frame=told.get("frame"), unit=told.get("units"))
    return JobPublic.of(services.import_jobs.start(wanted, upload.remove))


@router.get("/{case_id}")
def show_case(case_id: Identifier, services: ServicesDep) -> CasePublic:
    """One case, deleted or not."""
    return CasePublic.of(services.cases.get(case_id))


@router.patch("/{case_id}")
def change_case(case_id: Identifier, change: CaseUpdate, services: ServicesDep) -> CasePublic:
    """Rename a case; with `deleted`, take it off the lists or bring it back."""
    case = services.cases.get(case_id)
    if change.name is not None:
        case = services.cases.rename(case_id, change.name)
    if change.deleted is not None:
        case = services.cases.delete(case_id) if change.deleted else services.cases.restore(case_id)
    return CasePublic.of(case)


@router.delete("/{case_id}")
def delete_case(case_id: Identifier, services: ServicesDep) -> CasePublic:
    """Take a case off the lists; it can be restored."""
    return CasePublic.of(services.cases.delete(case_id))


@router.post("/{case_id}/restore")
def restore_case(case_id: Identifier, services: ServicesDep) -> CasePublic:
    """Bring a deleted case back."""
    return CasePublic.of(services.cases.restore(case_id))
