"""A case as a value: a head, its surfaces, its CT, and how its frame was known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

HEAD_PHANTOM = "head-phantom"  # id of the case that travels with vfix
BONE = "bone"  # the surface that the controller keeps away from

Triple = tuple[float, float, float]
Bounds = tuple[Triple, Triple]  # smallest and largest LPS coordinates [mm]


@dataclass(frozen=True)
class CaseFrame:
    """Frame of the file the case was made of, and whether that was assumed; inside, everything is LPS mm."""

    name: str
    assumed: bool


@dataclass(frozen=True)
class Bead:
    """A radio-opaque marker; position in LPS mm."""

    name: str
    position: Triple


@dataclass(frozen=True)
class SurfaceInfo:
    """A surface of a case. source: where it comes from, as `CaseFiles` reads it."""

    name: str
    triangles: int
    bounds_lps_mm: Bounds
    source: str


@dataclass(frozen=True)
class VolumeInfo:
    """A CT volume of a case; the first of a case is the widest."""

    name: str
    spacing_mm: Triple
    shape: tuple[int, int, int]  # voxels along i, j, k
    bounds_lps_mm: Bounds
    source: str
    slice_thickness_mm: float | None = None  # as the scanner told it


@dataclass(frozen=True)
class Case:
    """A stored head. A deleted case carries the time it was deleted at."""

    id: str
    name: str
    created: str
    deleted_at: str | None
    frame: CaseFrame
    spacing_mm: Triple | None
    content_hash: str
    surfaces: tuple[SurfaceInfo, ...]
    volumes: tuple[VolumeInfo, ...]
    beads: tuple[Bead, ...]
    notes: tuple[str, ...] = ()  # what was doubtful about the file, in sentences

    @property
    def has_volume(self) -> bool:
        return bool(self.volumes)

    @property
    def slice_thickness_mm(self) -> float | None:
        """Of its widest CT, where the file told it."""
        return self.volumes[0].slice_thickness_mm if self.volumes else None


@dataclass(frozen=True)
class CaseContent:
    """The part of a case that never changes once it is made."""

    frame: CaseFrame
    surfaces: tuple[SurfaceInfo, ...]
    volumes: tuple[VolumeInfo, ...] = ()
    beads: tuple[Bead, ...] = ()
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        return asdict(self)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> CaseContent:
        return cls(
            CaseFrame(**data["frame"]),
            tuple(
                SurfaceInfo(**{**item, "bounds_lps_mm": to_bounds(item["bounds_lps_mm"])}) for item in data["surfaces"]
            ),
            tuple(_volume_info(item) for item in data["volumes"]),
            tuple(Bead(item["name"], to_triple(item["position"])) for item in data["beads"]),
            tuple(data.get("notes", ())),
        )


def to_triple(values: Any) -> Triple:
    """Three numbers as plain floats."""
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def to_bounds(values: Any) -> Bounds:
    """Two corners (2, 3) as plain floats."""
    low, high = values
    return (to_triple(low), to_triple(high))


def _volume_info(item: Mapping[str, Any]) -> VolumeInfo:
    i, j, k = item["shape"]
    spacing, bounds = to_triple(item["spacing_mm"]), to_bounds(item["bounds_lps_mm"])
    return VolumeInfo(item["name"], spacing, (i, j, k), bounds, item["source"], item.get("slice_thickness_mm"))
