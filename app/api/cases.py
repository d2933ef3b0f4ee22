"""Cases: list, import, show, rename, delete and restore."""

from typing import Annotated, Any, cast, get_args

from fastapi import APIRouter, Query, Request
from starlette.concurrency import run_in_threadpool

from app.api.archives import start_import
from app.api.case_models import CasePublic, CaseUpdate
from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.uploads import MAX_FILES, USE_DESCRIPTION, form_of, receive
from app.cases.structures import CaseKind
from app.exchange.archive import is_archive
from app.imaging.importing import ImportRequest
from vfix_engine.errors import InputError

router = APIRouter(prefix="/cases", tags=["cases"], responses=ERRORS)

MAX_CASE_BYTES = 2 << 30  # [byte] of a case's file (HAZ-30)
KIND = "'lumen' for a surface that is its wall; else a head"
_FORM = form_of(
    {"file": "CT volume or bone surface", "names": "names of a segmentation"},
    {"name": "of the case; else its kind, a number and the time", "use_description": USE_DESCRIPTION, "kind": KIND},
)


@router.get("")
def list_cases(services: ServicesDep, include_deleted: Annotated[bool, Query()] = False) -> list[CasePublic]:
    """Every case, oldest first."""
    return [CasePublic.of(case) for case in services.cases.list(include_deleted)]


@router.post("", status_code=202, openapi_extra=_FORM)
async def import_case(request: Request, services: ServicesDep) -> JobPublic:
    """Upload a head; the response is a job whose result is the case's id.

    Several files 'file' are the slices of a DICOM folder, or a header and its voxels. For a file that leaves its frame,
    its unit or one of several series open, or is a segmentation, the job fails with what is `missing`. The file is
    kept: `POST /api/v1/jobs/{job_id}/answer` imports it without another upload. An archive of a case is imported as
    such.
    """
    fields = ("name", "use_description", "kind", "frame", "units")
    limits: dict[str, Any] = {"max_files": MAX_FILES, "beside": ("names",)}
    upload = await receive(request, services.store.scratch, MAX_CASE_BYTES, fields, **limits)
    if await run_in_threadpool(is_archive, upload.path):
        return start_import(services, upload)
    told, names = upload.fields, upload.beside.get("names")
    wanted = ImportRequest(
        upload.path,
        name=told.get("name"),
        use_description=upload.uses_description,
        kind=_kind(told.get("kind")),
        names=names,
        frame=told.get("frame"),
        unit=told.get("units"),
    )
    return JobPublic.of(services.import_jobs.start(wanted, upload.remove))


def _kind(told: str | None) -> CaseKind:
    """Raises InputError for another word."""
    for kind in get_args(CaseKind):
        if told in (None, kind):
            return cast(CaseKind, kind)
    raise InputError(f"a case is of the kind {' or '.join(get_args(CaseKind))}.")


@router.get("/{case_id}")
def show_case(case_id: Identifier, services: ServicesDep) -> CasePublic:
    """One case, deleted or not."""
    return CasePublic.of(services.cases.get(case_id))


@router.patch("/{case_id}")
def change_case(case_id: Identifier, change: CaseUpdate, services: ServicesDep) -> CasePublic:
    """Rename a case; `deleted` removes it from the lists or restores it."""
    return CasePublic.of(services.cases.change(case_id, name=change.name, deleted=change.deleted))


@router.delete("/{case_id}")
def delete_case(case_id: Identifier, services: ServicesDep) -> CasePublic:
    """Remove a case from the lists; it can be restored."""
    return CasePublic.of(services.cases.delete(case_id))


@router.post("/{case_id}/restore")
def restore_case(case_id: Identifier, services: ServicesDep) -> CasePublic:
    """Restore a deleted case."""
    return CasePublic.of(services.cases.restore(case_id))
