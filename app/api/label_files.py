"""Of painted labels what is no document: their voxels, files and surfaces."""

from typing import Annotated, Literal

from fastapi import APIRouter, Query, Response

from app.api.dependencies import ERRORS, Identifier, ServicesDep
from app.api.jobs import JobPublic
from app.plans.model import NOTICE
from vfix_engine.anatomy.labels.painting import runs_of

router = APIRouter(tags=["labels"], responses=ERRORS)

Form = Annotated[Literal["seg.nrrd", "nii.gz"], Query(description="of the file")]


@router.get(
    "/labels/{label_id}/voxels",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}}, "description": "uint32 run lengths, little-endian"}},
)
def label_voxels(label_id: Identifier, services: ServicesDep) -> Response:
    """The voxels as run lengths in the order of the volume's, i fastest: without, with, without, and so on.

    The ETag is the label's revision.
    """
    document = services.labels.documents.get(label_id)
    runs = runs_of(services.labels.mask(services.cases.get(document.case_id), document.content))
    headers = {"ETag": f'"{document.revision}"', "X-Notice": NOTICE, "Cache-Control": "no-store"}
    return Response(runs.astype("<u4").tobytes(), media_type="application/octet-stream", headers=headers)


@router.get(
    "/labels/{label_id}/file",
    response_class=Response,
    responses={200: {"content": {"application/octet-stream": {}}, "description": "the label as a file"}},
)
def label_as_file(label_id: Identifier, services: ServicesDep, form: Form = "seg.nrrd") -> Response:
    """The label as 3D Slicer's .seg.nrrd or a NIfTI label map."""
    headers = {"X-Notice": NOTICE, "Content-Disposition": f'attachment; filename="{label_id}.{form}"'}
    data = services.labels.file(label_id, form)
    return Response(data, media_type="application/octet-stream", headers=headers)


@router.post("/labels/{label_id}/surface", status_code=202)
def make_surface(label_id: Identifier, services: ServicesDep) -> JobPublic:
    """Make the label a structure, or give its structure the new border; the job's result is the structure's id."""
    return JobPublic.of(services.labels.start(label_id))
