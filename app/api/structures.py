"""Structures of a case: list, import of a segmentation, rename, recolour and delete."""

from fastapi import APIRouter, Request

from app.api.case_models import CasePublic, StructurePublic, StructureUpdate
from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.api.uploads import MAX_FILES, form_of, receive
from vfix_engine.anatomy.labels.reading import SegmentationRequest

router = APIRouter(prefix="/cases/{case_id}/structures", tags=["structures"], responses=ERRORS)

MAX_SEGMENTATION_BYTES = 1 << 30  # (HAZ-30)
_FORM = form_of({"file": "segmentation", "names": "table of names: JSON, CSV, TSV"}, {})


@router.get("")
def list_structures(case_id: Identifier, services: ServicesDep) -> list[StructurePublic]:
    """Every structure of a case, its anatomy first."""
    return CasePublic.of(services.cases.get(case_id)).structures


@router.post("", status_code=202, openapi_extra=_FORM)
async def import_structures(case_id: Identifier, request: Request, services: ServicesDep) -> JobPublic:
    """Upload a segmentation; the response is a job whose result is the case's id.

    Every label becomes a structure of the role 'spare'; several files 'file', or a zip, are NIfTI masks, one of each
    structure, which is named after its file. For a file without frame the job fails with `frame_error`; the
    file is kept: `POST /api/v1/jobs/{job_id}/answer` imports it without another upload.
    """
    services.cases.get(case_id)
    fields = ("frame", "units")
    upload = await receive(
        request, services.store.scratch, MAX_SEGMENTATION_BYTES, fields, max_files=MAX_FILES, beside=("names",)
    )
    told = upload.fields
    wanted = SegmentationRequest(
        upload.path, names=upload.beside.get("names"), frame=told.get("frame"), unit=told.get("units")
    )
    return JobPublic.of(services.import_jobs.start_structures(case_id, wanted, upload.remove))


@router.patch("/{structure_id}")
def change_structure(
    case_id: Identifier, structure_id: Identifier, change: StructureUpdate, services: ServicesDep
) -> StructurePublic:
    """Rename or recolour an imported structure."""
    case = services.structures.change(case_id, structure_id, name=change.name, colour=change.colour)
    return StructurePublic.model_validate(case.structure(structure_id), from_attributes=True)


@router.delete("/{structure_id}")
def delete_structure(case_id: Identifier, structure_id: Identifier, services: ServicesDep) -> list[StructurePublic]:
    """Delete an imported structure that no plan refers to; the response is the structures that are left."""
    return CasePublic.of(services.structures.delete(case_id, structure_id)).structures
