"""Volumes that are laid over a case's slices: list, import, rename and delete."""

from fastapi import APIRouter, Request

from app.api.case_models import CasePublic, OverlayPublic, OverlayUpdate
from app.api.cases import MAX_CASE_BYTES
from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.uploads import MAX_FILES, USE_DESCRIPTION, form_of, receive
from app.imaging.importing import OverlayRequest

router = APIRouter(tags=["second volumes"], responses=ERRORS)

_FORM = form_of(
    {"file": "CT or MR: DICOM, NRRD, NIfTI, MetaImage"},
    {"name": "of the volume; else its kind, a number and the time", "use_description": USE_DESCRIPTION},
)


@router.get("/cases/{case_id}/overlays")
def list_overlays(case_id: Identifier, services: ServicesDep) -> list[OverlayPublic]:
    """Volumes that can be laid over a case."""
    return CasePublic.of(services.cases.get(case_id)).overlays


@router.post("/cases/{case_id}/overlays", status_code=202, openapi_extra=_FORM)
async def import_overlay(case_id: Identifier, request: Request, services: ServicesDep) -> JobPublic:
    """Upload a CT or an MR; the response is a job whose result is the case's id.

    Files and open questions are those of `POST /api/v1/cases`. The volume is looked at only: bone, soft tissue and what
    holds the tool are those of the case's own CT.
    """
    services.cases.get(case_id)
    fields = ("name", "use_description", "frame", "units")
    upload = await receive(request, services.store.scratch, MAX_CASE_BYTES, fields, max_files=MAX_FILES)
    told = upload.fields
    wanted = OverlayRequest(
        upload.path,
        name=told.get("name"),
        use_description=upload.uses_description,
        frame=told.get("frame"),
        unit=told.get("units"),
    )
    return JobPublic.of(services.import_jobs.start_overlay(case_id, wanted, upload.remove))


@router.patch("/cases/{case_id}/overlays/{overlay_id}")
def rename_overlay(
    case_id: Identifier, overlay_id: Identifier, change: OverlayUpdate, services: ServicesDep
) -> list[OverlayPublic]:
    """Rename such a volume; the response is all of them."""
    return CasePublic.of(services.overlays.rename(case_id, overlay_id, change.name)).overlays


@router.delete("/cases/{case_id}/overlays/{overlay_id}")
def delete_overlay(case_id: Identifier, overlay_id: Identifier, services: ServicesDep) -> list[OverlayPublic]:
    """Delete such a volume; the response is those that are left."""
    return CasePublic.of(services.overlays.delete(case_id, overlay_id)).overlays
