"""What the API says about cases."""

from typing import Annotated

from pydantic import BaseModel, Field

from app.api.dependencies import Wish
from app.services.cases import Case
from app.services.names import MAX_NAME
from app.services.structures import CaseKind, Origin, Role

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


class ProvenancePublic(BaseModel):
    """Where a structure's surface comes from; threshold_hu: the value of a CT that it was extracted at."""

    origin: Origin
    threshold_hu: float | None


class StructurePublic(BaseModel):
    """A structure, which everything else refers to by its id.

    geometry: hash of its surface, `surface` which of the case's surfaces that is. deviation_mm: the largest distance
    measured from the surface that it was thinned from. has_inside: whether it is closed; null where not examined.
    """

    id: str
    name: str
    role: Role
    surface: str
    geometry: str
    provenance: ProvenancePublic
    deviation_mm: float | None
    has_inside: bool | None
    frame: str


class CasePublic(BaseModel):
    """A head, or a lumen."""

    id: str
    name: str
    created: str
    deleted_at: str | None
    kind: CaseKind
    frame: FramePublic
    spacing_mm: Triple | None
    surface_uncertainty_mm: float | None
    content_hash: str
    structures: list[StructurePublic]
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
