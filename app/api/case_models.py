"""Models of cases in the API."""

from typing import Annotated

from pydantic import BaseModel, Field

from app.api.dependencies import Flag, RequestBody
from app.cases.service import Case
from app.cases.structures import CaseKind, StructureOrigin, StructureRole
from app.kit.names import COLOUR, MAX_NAME

Triple = tuple[float, float, float]


class FramePublic(BaseModel):
    """Frame of the imported file; all values here are LPS mm."""

    name: str
    assumed: bool


class DroppedPublic(BaseModel):
    """Components removed from a surface; extent_mm is the largest diagonal of a component's box."""

    pieces: int
    triangles: int
    extent_mm: float


class SurfaceReportPublic(BaseModel):
    """Deviation of a surface by decimation, measured at every vertex of both surfaces, and removed components.

    certified_mm: no point of the source is farther from the surface; null where only vertices were measured.
    put_back: triangles of the source that decimation had moved too far. smoothed_mm: what smoothing moved at most.
    resampled_mm: what resampling within tilted slices may have moved.
    """

    mean_deviation_mm: float
    max_deviation_mm: float
    dropped: DroppedPublic
    certified_mm: float | None
    put_back: int
    smoothed_mm: float
    resampled_mm: float


class SurfacePublic(BaseModel):
    name: str
    triangles: int
    bounds_lps_mm: tuple[Triple, Triple]
    report: SurfaceReportPublic | None


class VolumePublic(BaseModel):
    """A volume; window: width and centre of grey values that the scanner's files suggest, null where they do not."""

    name: str
    spacing_mm: Triple
    shape: tuple[int, int, int]
    bounds_lps_mm: tuple[Triple, Triple]
    slice_thickness_mm: float | None
    window: tuple[float, float] | None


class BeadPublic(BaseModel):
    name: str
    position: Triple


class LandmarkPublic(BaseModel):
    """A named place of the anatomy, LPS mm."""

    name: str
    position: Triple


class ProvenancePublic(BaseModel):
    """Source of a structure's surface; threshold_hu: isovalue in a CT.

    label: number in a segmentation; voxel_mm: largest spacing of its grid.
    """

    origin: StructureOrigin
    threshold_hu: float | None
    label: int | None
    voxel_mm: float | None


class StructurePublic(BaseModel):
    """A structure, referred to by its id.

    surface: name among the case's surfaces; geometry: hash of it. deviation_mm: largest measured distance from the
    surface before decimation. has_inside: whether it is closed; null where not examined. colour: '#rrggbb'; null where
    it has none. notes: doubts about it.
    """

    id: str
    name: str
    role: StructureRole
    surface: str
    geometry: str
    provenance: ProvenancePublic
    deviation_mm: float | None
    has_inside: bool | None
    frame: str
    colour: str | None
    notes: list[str]


class OverlayPublic(BaseModel):
    """An MR or another scan that can be laid over the case; its voxels are had by its id as `volume`.

    window, level: its values from black to white, and the value in their middle.
    """

    id: str
    name: str
    window: float
    level: float
    volume: VolumePublic
    notes: list[str]


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
    overlays: list[OverlayPublic]
    has_volume: bool
    beads: list[BeadPublic]
    landmarks: list[LandmarkPublic]
    notes: list[str]
    unreadable: Annotated[str, Field(description="in a list: why the content cannot be read; '' where it can")]

    @classmethod
    def of(cls, case: Case) -> "CasePublic":
        return cls.model_validate(case, from_attributes=True)


class StructureUpdate(RequestBody):
    """Changes of an imported structure; omitted fields stay."""

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME)] | None = None
    colour: Annotated[str, Field(pattern=f"^{COLOUR}$")] | None = None


class OverlayUpdate(RequestBody):
    """Another name of a volume that can be laid over a case."""

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME)]


class CaseUpdate(RequestBody):
    """Changes of a case; omitted fields stay."""

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME)] | None = None
    deleted: Flag | None = None
