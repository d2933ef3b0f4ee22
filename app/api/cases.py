"""Cases: list, import, show, rename, delete and restore."""

from typing import Annotated, Any, cast, get_args

from fastapi import APIRouter, Query, Request
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from app.api.archives import start_import
from app.api.case_models import CasePublic, CaseUpdate
from app.api.dependencies import ERRORS, Identifier, Number, RequestBody, ServicesDep
from app.api.jobs import JobPublic
from app.api.uploads import MAX_FILES, USE_DESCRIPTION, form_of, receive
from app.cases.structures import CaseKind
from app.exchange.archive import is_archive
from app.imaging.importing import ImportRequest
from app.kit.values import check_position, number
from vfix_engine.anatomy.lumen_import import AIR_HU
from vfix_engine.errors import InputError

router = APIRouter(prefix="/cases", tags=["cases"], responses=ERRORS)

MAX_CASE_BYTES = 2 << 30  # [byte] of a case's file (HAZ-30)
KIND = "'lumen' for one; else a head"
_FORM = form_of(
    {"file": "CT volume or bone surface", "names": "names of a segmentation"},
    {
        "name": "of the case; else its kind, a number and the time",
        "use_description": USE_DESCRIPTION,
        "kind": KIND,
        "label": "of a lumen: number of its label in a label map",
        "seed": "of a lumen: a place in its air in a CT, 'x,y,z' in LPS mm; else the largest air in the body",
        "air_hu": "of a lumen: its air in a CT at most, -500 without",
    },
)


class LumenAt(RequestBody):
    """seed: a place in the lumen, LPS mm. air_hu: of its air at most."""

    seed: tuple[Number, Number, Number]
    air_hu: Annotated[Number, Field(ge=-2000.0, le=0.0)] = AIR_HU


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
    fields = ("name", "use_description", "kind", "label", "seed", "air_hu", "frame", "units")
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
        **_of_lumen(told),
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


def _of_lumen(told: dict[str, str]) -> dict[str, Any]:
    """What is said of a lumen alone. Raises InputError for what is no number."""
    label, seed, air = told.get("label"), told.get("seed"), told.get("air_hu")
    found: dict[str, Any] = {}
    if label is not None:
        if not label.isdecimal() or len(label) > 9:
            raise InputError("a label is a whole number.")
        found["label"] = int(label)
    if seed is not None:
        found["seed"] = check_position(tuple(_number(part, "the seed") for part in seed.split(",")))
    if air is not None:
        found["air_hu"] = _number(air, "the threshold of air")
    return found


def _number(text: str, what: str) -> float:
    try:
        return number(float(text), what)
    except ValueError:
        raise InputError(f"{what} must be a number.") from None


@router.post("/{case_id}/lumen", status_code=202)
def lumen_of_case(case_id: Identifier, body: LumenAt, services: ServicesDep) -> JobPublic:
    """Make a case of another lumen in a case's CT, as a job: the air at a seed; its result is the new case's id."""
    return JobPublic.of(services.import_jobs.start_lumen(case_id, body.seed, body.air_hu))


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
