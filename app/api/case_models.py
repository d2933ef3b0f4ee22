"""What the API says about cases."""

from typing import Annotated

from pydantic import BaseModel, Field

from app.api.dependencies import Wish
from app.services.cases import Case
from app.services.names import MAX_NAME

Triple = tuple[float, float, float]


class FramePublic(BaseModel):
    """Frame of the file that the case was made of; everything here is LPS mm."""

    name: str
    assumed: bool


class DroppedPublic(BaseModel):
    """Loose pieces that were left out of a surface; extent_mm is the largest diagonal of a piece's box."""

    pieces: int
    triangles: int
    extent_mm: float


class SurfaceReportPublic(BaseModel):
    """What making a surface cost: how far thinning moved it, at every vertex both ways, and what was left out."""

    mean_deviation_mm: float
    max_deviation_mm: float
    dropped: DroppedPublic


class SurfacePublic(BaseModel):
    name: str
    triangles: int
    bounds_lps_mm: tuple[Triple, Triple]
    report: SurfaceReportPublic | None


class VolumePublic(BaseModel):
    name: str
    spacing_mm: Triple
    shape: tuple[int, int, int]
    bounds_lps_mm: tuple[Triple, Triple]
    slice_thickness_mm: float | None


class BeadPublic(BaseModel):
    name: str
    position: Triple


class CasePublic(BaseModel):
    """A head."""

    id: str
    name: str
    created: str
    deleted_at: str | None
    frame: FramePublic
    spacing_mm: Triple | None
    surface_uncertainty_mm: float | None
    content_hash: str
    surfaces: list[SurfacePublic]
    volumes: list[VolumePublic]
    has_volume: bool
    beads: list[BeadPublic]
    notes: list[str]

    @classmethod
    def of(cls, case: Case) -> "CasePublic":
        return cls.model_validate(case, from_attributes=True)


class CaseUpdate(Wish):
    """Changes of a case; what is left out stays."""

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME)] | None = None
    deleted: bool | None = None
