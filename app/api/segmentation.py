"""Segmentation of a case's CT by a band of Hounsfield units."""

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Response
from pydantic import Field

from app.api.dependencies import ERRORS, Identifier, Number, RequestBody, ServicesDep
from app.api.jobs import JobPublic
from app.imaging.segmenting import StructureRequest, structure_request
from app.kit.names import MAX_NAME
from app.plans.model import NOTICE
from vfix_engine.anatomy.islands import Islands
from vfix_engine.anatomy.labels.painting import runs_of
from vfix_engine.anatomy.segmentation import SegmentRequest

router = APIRouter(prefix="/cases/{case_id}/segment", tags=["structures"], responses=ERRORS)

_RUNS: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/octet-stream": {}}, "description": "uint32 run lengths, little-endian"}
}
Corner = tuple[Number, Number, Number]  # LPS mm
Preset = Literal["bone", "thin_bone", "soft_tissue", "air", "mucosa", "unseen_bone"]


class IslandsRequest(RequestBody):
    """A preset or a band [HU]; crop_mm: two LPS corners; least_mm3: of an island, else as the preset has it."""

    preset: Preset | None = None
    low_hu: Number | None = None
    high_hu: Number | None = None
    crop_mm: tuple[Corner, Corner] | None = None
    largest: Annotated[bool, Field(strict=True)] = False
    least_mm3: Annotated[Number, Field(ge=0.0)] | None = None

    def request(self) -> SegmentRequest:
        """What the service takes. Raises InputError without a preset or a band."""
        crop, low, high = self.crop_mm, self.low_hu, self.high_hu
        return structure_request("Islands", self.preset, low, high, crop, self.largest, self.least_mm3, 0.0).request


class SegmentCreate(IslandsRequest):
    """What to segment, its name, and smooth_mm: blur of the border."""

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME)]
    smooth_mm: Annotated[Number, Field(ge=0.0)] = 0.0

    def structure_request(self) -> StructureRequest:
        """What the service takes. Raises InputError without a preset or a band."""
        return structure_request(
            self.name,
            self.preset,
            self.low_hu,
            self.high_hu,
            self.crop_mm,
            self.largest,
            self.least_mm3,
            self.smooth_mm,
        )


@router.post("", status_code=202)
def segment_case(case_id: Identifier, body: SegmentCreate, services: ServicesDep) -> JobPublic:
    """Segment the widest CT of a case; the response is a job whose result is the id of the new structure."""
    return JobPublic.of(services.segmenting.start(case_id, body.structure_request()))


@router.post("/islands", response_class=Response, responses=_RUNS)
def half_islands(case_id: Identifier, body: IslandsRequest, services: ServicesDep) -> Response:
    """What of a threshold is kept, on every second voxel of the widest CT along each axis; nothing is stored.

    Run lengths as of painted labels. X-Step: of the voxels; X-Islands, X-Left-Out, X-Volume-Mm3: what was found.
    """
    return _runs(services.islands.half(case_id, body.request()))


@router.post("/islands/full", status_code=202)
def full_islands(case_id: Identifier, body: IslandsRequest, services: ServicesDep) -> JobPublic:
    """The same on every voxel, as a job; its result is the last part of the address that has them."""
    return JobPublic.of(services.islands.start(case_id, body.request()))


@router.get("/islands/{result}", response_class=Response, responses=_RUNS)
def found_islands(case_id: Identifier, result: Identifier, services: ServicesDep) -> Response:
    """What such a job found; the newest few are kept until the planner ends."""
    services.cases.get(case_id)
    return _runs(services.islands.result(result))


def _runs(found: Islands) -> Response:
    headers = {
        "X-Notice": NOTICE,
        "Cache-Control": "no-store",
        "X-Step": str(found.step),
        "X-Islands": str(found.islands),
        "X-Left-Out": str(found.left_out),
        "X-Volume-Mm3": f"{found.volume_mm3:.1f}",
    }
    return Response(runs_of(found.mask).astype("<u4").tobytes(), media_type="application/octet-stream", headers=headers)
