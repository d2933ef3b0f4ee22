"""Segmentation of a CT by a band of Hounsfield units: islands, crop box, smoothing; a surface with its error.

The surface encloses the voxels: however thin the structure is, the centre of each lies inside, smoothed or not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.airway import body
from vfix_engine.anatomy.enclosing import enclosing_surface
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.anatomy.thinning import bound_over
from vfix_engine.anatomy.tissue_regions import near_air, sheets_between_air
from vfix_engine.arrays import BoolArray
from vfix_engine.errors import ImageError
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback, no_progress
from vfix_engine.proximity.proximity import ProximityTree

LOWEST_HU, HIGHEST_HU = -2000.0, 10_000.0
MOST_SMOOTHING_MM = 3.0
MAX_TRIANGLES = 5_000_000
_FAR_OUTSIDE = -1000  # [HU] level of voxels that are removed
_KEPT = 100  # of 1000: smallest value of a blurred voxel that keeps its centre within the surface
_CHUNK = 100_000


@dataclass(frozen=True)
class Band:
    """Hounsfield units from low to high, both included. inside_body: only within the body, such as air of the airways.

    region: 'mucosa' for tissue next to air within the body, 'sheets' for thin ones between two air spaces, else all.
    least_mm3: smaller islands are left out unless a request states otherwise; air within the body has thousands, of a
        few voxels each.
    """

    low_hu: float
    high_hu: float
    inside_body: bool = False
    region: Literal["all", "mucosa", "sheets"] = "all"
    least_mm3: float = 0.0


PRESETS: dict[str, Band] = {
    "bone": Band(BONE_HU, HIGHEST_HU),
    "thin_bone": Band(120.0, HIGHEST_HU),
    "soft_tissue": Band(TISSUE_HU, 119.0),
    "air": Band(LOWEST_HU, TISSUE_HU - 1.0, inside_body=True, least_mm3=100.0),
    "mucosa": Band(TISSUE_HU, 119.0, region="mucosa"),
    "unseen_bone": Band(TISSUE_HU, BONE_HU - 1.0, region="sheets"),
}


@dataclass(frozen=True)
class SegmentRequest:
    """Parameters of a segmentation.

    band: of the voxels. crop_mm: (2, 3) LPS corners of a box, None for the whole scan.
    largest: keep only the largest island. least_mm3: leave out smaller islands; None: the band's value.
    smooth_mm: standard deviation of the blur that smooths the border; 0 for none.

    Raises ImageError for invalid values.
    """

    band: Band
    crop_mm: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    largest: bool = False
    least_mm3: float | None = None
    smooth_mm: float = 0.0

    def __post_init__(self) -> None:
        band = self.band
        if not LOWEST_HU <= band.low_hu <= band.high_hu <= HIGHEST_HU:
            raise ImageError(
                f"the threshold runs from {band.low_hu:g} to {band.high_hu:g} HU; it must rise, and lie within "
                f"{LOWEST_HU:g} to {HIGHEST_HU:g} HU."
            )
        if not 0.0 <= self.smallest_mm3 < np.inf:
            raise ImageError(f"the smallest island must be 0 mm³ or more, not {self.least_mm3:g}.")
        if not 0.0 <= self.smooth_mm <= MOST_SMOOTHING_MM:
            raise ImageError(f"smoothing takes 0 to {MOST_SMOOTHING_MM:g} mm, not {self.smooth_mm:g}.")
        if self.crop_mm is not None and not np.isfinite(np.asarray(self.crop_mm)).all():
            raise ImageError("the corners of the crop box must be finite numbers in mm.")

    @property
    def smallest_mm3(self) -> float:
        """Volume of an island below which it is left out."""
        return self.band.least_mm3 if self.least_mm3 is None else self.least_mm3


@dataclass(frozen=True, eq=False)
class Segmented:
    """A segmented surface, LPS mm, with outward normals.

    volume_mm3: of its voxels. enclosed_mm3: enclosed by the surface. islands, left_out: total number, and number of
        those left out.
    smoothed_mm: upper bound of the distance of the border before smoothing from the surface.
    resampled_mm: upper bound of the displacement by resampling within the slices of the CT.
    """

    mesh: TriangleMesh
    volume_mm3: float
    enclosed_mm3: float
    islands: int
    left_out: int
    smoothed_mm: float
    resampled_mm: float


def segment(volume: Volume, request: SegmentRequest, tell: ProgressCallback = no_progress) -> Segmented:
    """Segment a CT. The surface is closed where the scan, the crop box or the body ends.

    tell: called with the stage in words and the completed fraction; an exception from it ends the work.

    Raises:
        ImageError: no voxel is in the band, or the crop box lies outside the scan.
    """
    tell("Choosing the voxels", 0.0)
    band, inside = request.band, region_of(volume, request.band)
    box = crop_of(volume, request.crop_mm)
    origin = volume.index_to_lps([each.start for each in box[::-1]])
    part = Volume(volume.hu[box], origin, volume.spacing, volume.direction)
    level = level_of(part, band, None if inside is None else inside[box])
    tell("Telling the islands apart", 0.2)
    islands, left_out = leave_out(level, part, request)
    tell("Finding the border", 0.4)
    mask = level >= 0
    mesh = enclosing_surface(part, mask, (band.low_hu, band.high_hu))
    if len(mesh.faces) > MAX_TRIANGLES:
        raise ImageError(
            f"the surface would have {len(mesh.faces):,} triangles; at most {MAX_TRIANGLES:,} are used. Leave small "
            "islands out, or crop."
        )
    voxels = int(np.count_nonzero(mask)) * float(np.prod(part.spacing))
    found = Segmented(mesh, voxels, mesh.volume_mm3, islands, left_out, 0.0, volume.resampled_mm or 0.0)
    return found if request.smooth_mm == 0.0 else _smoothed(found, part, mask, request.smooth_mm, tell)


def region_of(volume: Volume, band: Band) -> BoolArray | None:
    """Mask (K, J, I) to which a band is restricted; None for the whole scan."""
    if band.region != "all":
        return near_air(volume) if band.region == "mucosa" else sheets_between_air(volume)
    return body(volume) if band.inside_body else None


def level_of(part: Volume, band: Band, inside: BoolArray | None) -> npt.NDArray[np.int16]:
    """Level of voxels (K, J, I) relative to a band, HU: ≥ 0 within it. inside: mask to which it is restricted, or None.

    Raises ImageError if no voxel lies in the band.
    """
    low, high = int(np.ceil(band.low_hu)), int(np.floor(band.high_hu))
    hu = part.hu.astype(np.int32)
    level = np.clip(np.minimum(hu - low, high - hu), -32000, 32000).astype(np.int16)
    if inside is not None:
        level[~inside] = np.minimum(level[~inside], _FAR_OUTSIDE)
    if not (level >= 0).any():
        raise ImageError(f"no voxel lies between {low} and {high} HU; widen the threshold or the crop box.")
    return level


def crop_of(volume: Volume, corners: tuple[tuple[float, ...], tuple[float, ...]] | None) -> tuple[slice, slice, slice]:
    """Slices [k, j, i] of the voxels in a box, all without one; for an oblique box, those of its bounding box.

    Raises ImageError for a box outside the scan.
    """
    counts = np.array(volume.hu.shape[::-1])
    low, high = np.zeros(3, dtype=int), counts
    if corners is not None:
        box = np.sort(np.asarray(corners, dtype=np.float64), axis=0)
        places = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
        index = volume.lps_to_index(places)
        low = np.clip(np.ceil(index.min(axis=0) - 1e-6).astype(int), 0, counts)
        high = np.clip(np.floor(index.max(axis=0) + 1e-6).astype(int) + 1, 0, counts)
    if (high - low < 2).any():
        raise ImageError("the crop box holds fewer than two voxels along an axis; move it into the scan.")
    i, j, k = (slice(int(first), int(last)) for first, last in zip(low, high, strict=True))
    return k, j, i


def leave_out(level: npt.NDArray[np.int16], part: Volume, request: SegmentRequest) -> tuple[int, int]:
    """Remove islands from the level; return their number and the number removed."""
    from scipy import ndimage  # imported here: slow to load

    label, count = ndimage.label(level >= 0)
    if not request.largest and not request.smallest_mm3:
        return int(count), 0
    size = np.bincount(label.ravel(), minlength=count + 1) * float(np.prod(part.spacing))
    size[0] = 0.0
    kept = size >= max(request.smallest_mm3, 1e-12)
    if request.largest:
        kept &= np.arange(count + 1) == int(size.argmax())
    kept[0] = True
    if not kept[1:].any():
        raise ImageError(
            f"every island is smaller than {request.smallest_mm3:g} mm³; the largest has {size.max():.0f} mm³."
        )
    level[~kept[label]] = _FAR_OUTSIDE
    return int(count), int(np.count_nonzero(~kept[1:]))


def _smoothed(found: Segmented, part: Volume, mask: BoolArray, smooth_mm: float, tell: ProgressCallback) -> Segmented:
    """Extract the border of the blurred voxels, and bound its distance from the sharp one."""
    from scipy import ndimage  # as above

    tell("Smoothing the border", 0.6)
    chosen = np.pad(mask, 1)  # closes the surface where the part ends
    inside = np.where(chosen, np.float32(1000.0), np.float32(-1000.0))
    blurred = ndimage.gaussian_filter(inside, smooth_mm / part.spacing[::-1], mode="nearest")
    values = np.rint(blurred).astype(np.int16)
    # Without this, the blur would remove structures thinner than it.
    values[chosen] = np.maximum(values[chosen], _KEPT)
    mesh = extract_surface(Volume(values, part.index_to_lps([-1.0, -1.0, -1.0]), part.spacing, part.direction), 0.0)
    tree, bound = ProximityTree(mesh), 0.0
    for start in range(0, len(found.mesh.faces), _CHUNK):
        tell("Measuring what smoothing moved", 0.7 + 0.3 * start / len(found.mesh.faces))
        triangles = found.mesh.vertices[found.mesh.faces[start : start + _CHUNK]]
        bound = max(bound, float(bound_over(triangles, tree, 0.5 * float(part.spacing.min())).max()))
    return replace(found, mesh=mesh, enclosed_mm3=mesh.volume_mm3, smoothed_mm=bound)
