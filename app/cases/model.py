"""A case as a value: what was imported, its structures, surfaces and CT, and how its frame was known."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from app.cases.structures import (
    ANATOMY,
    BONE,
    CaseKind,
    Provenance,
    Structure,
    structure_name,
    within_a_sentence,
)
from app.kit.errors import NotFound
from app.kit.values import Position
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty, describe_report, uncertainty_of
from vfix_engine.files.volume import BONE_HU

HEAD_PHANTOM = "head-phantom"  # id of the case that travels with vfix

CAVITY = "phantom:cavity"  # source of its surface
CAVITY_PHANTOM = "cavity-phantom"  # id of the body cavity that travels with vfix
COLON_PHANTOM = "colon-phantom"  # id of the lumen that travels with vfix
HARD_COLON = "colon-hard"  # the one with collapsed stretches and tight flexures
SHIPPED = (HEAD_PHANTOM, COLON_PHANTOM, HARD_COLON, CAVITY_PHANTOM)

Bounds = tuple[Position, Position]  # smallest and largest LPS coordinates [mm]


@dataclass(frozen=True)
class CaseFrame:
    """Frame of the file the case was made of, and whether that was assumed; inside, everything is LPS mm."""

    name: str
    assumed: bool


@dataclass(frozen=True)
class CaseBead:
    """A radio-opaque marker; position in LPS mm."""

    name: str
    position: Position


@dataclass(frozen=True)
class CaseLandmark:
    """A named place of the anatomy, such as a flexure of a colon; position in LPS mm."""

    name: str
    position: Position


@dataclass(frozen=True)
class SurfaceInfo:
    """A surface of a case.

    source: where it comes from, as `CaseFiles` reads it. report: what making it cost; None where that was not measured.
    """

    name: str
    triangles: int
    bounds_lps_mm: Bounds
    source: str
    report: SurfaceReport | None = None

    @property
    def words(self) -> str:
        """What making it cost, for people; '' for a surface on show of which nothing is known."""
        if self.report is not None:
            return describe_report(self.report)
        return "what was left out or thinned is not recorded" if self.name == BONE else ""

    def summary(self) -> dict[str, Any]:
        """What `--json` prints of a surface."""
        report = None if self.report is None else asdict(self.report)
        return {
            "name": self.name,
            "triangles": self.triangles,
            "bounds_lps_mm": [list(corner) for corner in self.bounds_lps_mm],
            "report": report,
        }


@dataclass(frozen=True)
class VolumeInfo:
    """A CT volume of a case; the first of a case is the widest."""

    name: str
    spacing_mm: Position
    shape: tuple[int, int, int]  # voxels along i, j, k
    bounds_lps_mm: Bounds
    source: str
    slice_thickness_mm: float | None = None  # as the file of the scanner says
    window: tuple[float, float] | None = None  # width and centre that it suggests [HU]


@dataclass(frozen=True)
class Overlay:
    """An MR or another scan that can be laid over the case's slices, and is only looked at.

    window, level: its values from black to white, and the value in their middle. notes: doubts about its file.
    """

    id: str
    name: str
    window: float
    level: float
    volume: VolumeInfo
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Case:
    """A stored case. A deleted one carries the time it was deleted at.

    kind: what is driven in it. structures: what plans, zones and scores refer to by id; surfaces: what is drawn.
    unreadable: in a list, why its content cannot be read; it has no surfaces and structures there then.
    """

    id: str
    name: str
    created: str
    deleted_at: str | None
    frame: CaseFrame
    spacing_mm: Position | None
    content_hash: str
    surfaces: tuple[SurfaceInfo, ...]
    volumes: tuple[VolumeInfo, ...]
    beads: tuple[CaseBead, ...]
    notes: tuple[str, ...] = ()  # what was doubtful about the file, in sentences
    kind: CaseKind = "head"
    structures: tuple[Structure, ...] = ()
    overlays: tuple[Overlay, ...] = ()
    unreadable: str = ""
    landmarks: tuple[CaseLandmark, ...] = ()

    @property
    def anatomy(self) -> Structure:
        """The structure that the controller keeps clear of, or stays within, by the kind of case."""
        return next(item for item in self.structures if item.role == ANATOMY[self.kind])

    def structure(self, structure_id: str) -> Structure:
        """The structure of that id. Raises NotFound."""
        for item in self.structures:
            if item.id == structure_id:
                return item
        known = ", ".join(item.id for item in self.structures)
        raise NotFound(f"this case has no structure {structure_id!r:.40}; it has: {known}.")

    def structure_words(self, structure_id: str) -> str:
        """The name of a structure for people; of an id that is not there any more, the id."""
        return next((item.name for item in self.structures if item.id == structure_id), structure_id)

    def structure_names(self) -> dict[str, str]:
        """The name of every structure by its id, as it is written within a sentence: 'bone', 'optic nerve', 'ICA'."""
        return {item.id: within_a_sentence(self.structure_words(item.id)) for item in self.structures}

    @property
    def protectable(self) -> tuple[Structure, ...]:
        """The structures beside its anatomy, which plans can protect."""
        return tuple(item for item in self.structures if item.role == "spare")

    @property
    def own_surfaces(self) -> tuple[SurfaceInfo, ...]:
        """The surfaces that the case was made with: all but those of imported structures."""
        return own_surfaces(self)

    def structure_errors(self) -> dict[str, float]:
        """How far smoothing or thinning may have moved the surface of each protectable structure, in mm, by its id."""
        return {item.id: item.deviation_mm or 0.0 for item in self.protectable}

    @property
    def has_volume(self) -> bool:
        return bool(self.volumes)

    @property
    def slice_thickness_mm(self) -> float | None:
        """Of its widest CT, where the file says it."""
        return self.volumes[0].slice_thickness_mm if self.volumes else None

    @cached_property
    def uncertainty(self) -> SurfaceUncertainty:
        """How far the anatomy may lie from its surface, as far as that is known."""
        voxel_mm = max(*(self.spacing_mm or (0.0,)), self.slice_thickness_mm or 0.0, 0.0)
        info = next((item for item in self.surfaces if item.name == self.anatomy.surface), None)
        if info is None or info.report is None:
            return SurfaceUncertainty(self.anatomy.deviation_mm or 0.0, voxel_mm)
        return uncertainty_of(info.report, voxel_mm)

    @property
    def surface_uncertainty_mm(self) -> float | None:
        """How far bone may lie off its surface; None for a surface that came without a CT."""
        return self.uncertainty.off_mm if self.has_volume else None


@dataclass(frozen=True)
class CaseContent:
    """What is stored of a case: what it was made of, which never changes, and what was imported into it."""

    frame: CaseFrame
    surfaces: tuple[SurfaceInfo, ...]
    volumes: tuple[VolumeInfo, ...] = ()
    beads: tuple[CaseBead, ...] = ()
    notes: tuple[str, ...] = ()
    kind: CaseKind = "head"
    structures: tuple[Structure, ...] = ()
    overlays: tuple[Overlay, ...] = ()
    landmarks: tuple[CaseLandmark, ...] = ()

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def own_surfaces(content: CaseContent | Case) -> tuple[SurfaceInfo, ...]:
    """The surfaces that a case was made with: all but those of imported structures."""
    imported = {item.surface for item in content.structures if item.role == "spare"}
    return tuple(item for item in content.surfaces if item.name not in imported)


def anatomy_structure(
    kind: CaseKind, surface: SurfaceInfo, geometry: str, provenance: Provenance, has_inside: bool | None
) -> Structure:
    """The structure that a case of a kind is driven in, out of its surface; geometry: 'sha256:' and the file's hash."""
    role = ANATOMY[kind]
    deviation = None if surface.report is None else surface.report.max_deviation_mm
    return Structure(role, structure_name(role), role, surface.name, geometry, provenance, deviation, has_inside)


def extracted_from(has_volume: bool) -> Provenance:
    """The provenance of a surface that an import made: of a CT at the threshold of bone, or of a surface's file."""
    return Provenance("ct", BONE_HU) if has_volume else Provenance("surface")


def to_triple(values: Any) -> Position:
    """Three numbers as plain floats."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def to_bounds(values: Any) -> Bounds:
    """Two corners (2, 3) as plain floats."""
    low, high = values
    return (to_triple(low), to_triple(high))
