"""The two bone surfaces of a case from a CT or a mesh: one for control, one for display."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vfix_engine.anatomy.beside_head import BoneOfPlates, bone_of_plates
from vfix_engine.anatomy.surface import Dropped, clean, extract_surface
from vfix_engine.anatomy.thinning import ThinnedSurface, clustered, collapsed, measured, within
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback

# The surface for control. Up to the first size it is the complete extracted surface; above it, it is decimated to the
# second one, and triangles that this moved too far are restored.
CONTROL_TRIANGLES = 4_000_000
THINNED_TRIANGLES = 3_000_000
TOLERANCE_MM = 0.1  # largest distance of a vertex of the extracted surface from the decimated one
DISPLAY_TRIANGLES = 60_000
# Surface for display: above the first size it is first clustered in cells, five times as fast as edge collapse.
CLUSTERED_FROM = 1_000_000
CLUSTERED_TRIANGLES = 500_000
# Fractions of the total time, measured on the synthetic head with a million triangles: 1.6 of 4.6 s extract the bone;
# of the 3.0 s for display 0.9 s remove components, 0.6 s decimate, the rest measures the deviation.
TOLD, FOUND, CLEANED, THINNED = 0.3, 0.5, 0.3, 0.3
MIN_BODY_TRIANGLES = 100  # smaller components are removed for display; the surface for control keeps them
USUAL_SLICE_MM = 1.0  # largest slice distance for navigation in the nose
SLICE_SHARE = 0.5  # of a larger slice distance: uncertainty of the surface


@dataclass(frozen=True)
class SurfaceReport:
    """Deviation of a surface from its source, and the components removed from it.

    mean_deviation_mm, max_deviation_mm: of decimation, as in `ThinnedSurface`; 0 without decimation.
    dropped: components removed: for control those of plates beside the head, for display also those that are noise.
    certified_mm: upper bound of the distance of any point of the source from the surface; None if only vertices were
        measured.
    put_back: triangles of the source that were restored because decimation had moved them too far.
    smoothed_mm: largest displacement of a vertex by smoothing; 0 without smoothing.
    resampled_mm: upper bound of the displacement by resampling within the slices of the CT; 0 without resampling.
    """

    mean_deviation_mm: float
    max_deviation_mm: float
    dropped: Dropped
    certified_mm: float | None = None
    put_back: int = 0
    smoothed_mm: float = 0.0
    resampled_mm: float = 0.0

    @property
    def error_mm(self) -> float:
        """Distance that is added to the margin: upper bound of the error by decimation, smoothing and resampling."""
        thinned = self.max_deviation_mm if self.certified_mm is None else self.certified_mm
        return thinned + self.smoothed_mm + self.resampled_mm


@dataclass(frozen=True)
class BoneSurfaces:
    """control, display: surfaces in LPS mm, normals out of bone.

    control_report: of `control` against the extracted surface. display_report: of `display` against `control`.
    """

    control: TriangleMesh
    display: TriangleMesh
    control_report: SurfaceReport
    display_report: SurfaceReport

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence on what is left out of both as no part of the head, if anything is, and how far to trust that."""
        out = self.control_report.dropped
        if not out.pieces:
            return ()
        pieces = "1 piece" if out.pieces == 1 else f"{out.pieces} pieces"
        return (
            f"Not in the bone: {pieces} beside the head, as of a headrest. "
            f"They have {out.triangles:,} triangles and are {out.extent_mm:.0f} mm across at most; the slices show "
            "them, the robot does not keep clear of them. Look whether any is part of the patient or fixed to it.",
        )


def slice_uncertainty_mm(spacing_mm: float) -> float:
    """Uncertainty of a bone surface in mm, for a CT with the largest voxel spacing `spacing_mm`.

    0 up to 1 mm, half of the spacing above. Measured on the synthetic head: for 0.5 mm slices averaged to 1.5 … 5 mm,
    at least 95 % of the bone lies within that distance of the surface.
    """
    return SLICE_SHARE * spacing_mm if spacing_mm > USUAL_SLICE_MM else 0.0


def bone_of_volume(volume: Volume, *, progress: ProgressCallback) -> BoneSurfaces:
    """Extract the bone of a CT: all triangles for control but those of plates beside the head; fewer for display.

    Raises:
        ImageError: there is no bone.
    """
    progress("Telling the head from what lies beside it", 0.0)
    plates = bone_of_plates(volume)
    head, dropped = (volume, Dropped()) if plates is None else _without(volume, plates)
    telling = lambda share: progress("Finding the bone", TOLD + (FOUND - TOLD) * share)  # noqa: E731
    surface = extract_surface(head, BONE_HU, tell=telling)
    made = surfaces_of(surface, progress=lambda stage, share: progress(stage, FOUND + (1.0 - FOUND) * share))
    report = replace(made.control_report, dropped=dropped, resampled_mm=volume.resampled_mm or 0.0)
    return replace(made, control_report=report)


def _without(volume: Volume, plates: BoneOfPlates) -> tuple[Volume, Dropped]:
    """The volume in which plates are no denser than soft tissue, and what of their surface is left out by that.

    The surface of the rest stays as it is: no cell has voxels of two pieces.
    """
    soft = np.int16(BONE_HU - 1.0)
    rest, alone = (
        Volume(np.where(mask, soft, volume.hu), volume.origin, volume.spacing, volume.direction)
        for mask in (plates.voxels, (volume.hu >= BONE_HU) & ~plates.voxels)
    )
    return rest, Dropped(plates.pieces, len(extract_surface(alone, BONE_HU).faces), plates.extent_mm)


def surfaces_of(surface: TriangleMesh, *, progress: ProgressCallback) -> BoneSurfaces:
    """Surfaces for control and for display from an extracted surface; control keeps all of it."""
    control, done = ThinnedSurface(surface, 0.0, 0.0, 0.0), 0.0
    if len(surface.faces) > CONTROL_TRIANGLES:
        progress("Thinning the surface", 0.0)
        fewer = collapsed(surface, THINNED_TRIANGLES)
        telling = lambda share: progress("Measuring what thinning moved", 0.2 + 0.5 * share)  # noqa: E731
        control, done = within(surface, fewer, TOLERANCE_MM, telling), 0.7
    words = _thinned_words(len(surface.faces), control) + "; making the picture of it"
    return _with_display(control, lambda share: progress(words, done + (1.0 - done) * share))


def _thinned_words(before: int, surface: ThinnedSurface) -> str:
    after = len(surface.mesh.faces)
    if after == before:
        return f"{before:,} triangles, kept whole"
    return f"{before:,} triangles, thinned to {after:,} ({surface.certified_mm or 0.0:.2f} mm off at most)"


def bone_of_surface(surface: TriangleMesh, *, progress: ProgressCallback) -> BoneSurfaces:
    """Surfaces of a case from a mesh: unchanged for control, decimated for display."""
    return _with_display(
        ThinnedSurface(surface, 0.0, 0.0, 0.0), lambda share: progress("Making the picture of it", share)
    )


def _with_display(control: ThinnedSurface, tell: Callable[[float], None]) -> BoneSurfaces:
    """Add the surface for display without small components, unless there are no others."""
    tell(0.0)
    source = control.mesh
    cleaned = (
        clean(source, min(MIN_BODY_TRIANGLES, len(source.faces))) if len(source.faces) > DISPLAY_TRIANGLES else None
    )
    if cleaned is None:
        display, dropped = ThinnedSurface(source, 0.0, 0.0, 0.0), Dropped()
    else:
        telling = lambda share: tell(CLEANED + (1.0 - CLEANED) * share)  # noqa: E731
        display, dropped = thinned_for_display(cleaned.mesh, DISPLAY_TRIANGLES, telling), cleaned.dropped
    return BoneSurfaces(control.mesh, display.mesh, _report(control, Dropped()), _report(display, dropped))


def thinned_for_display(
    surface: TriangleMesh, target_triangles: int, tell: Callable[[float], None] = lambda share: None
) -> ThinnedSurface:
    """Decimate a surface of any size to about `target_triangles` for display, and measure the deviation."""
    tell(0.0)
    fewer = clustered(surface, CLUSTERED_TRIANGLES) if len(surface.faces) > CLUSTERED_FROM else surface
    fewer = collapsed(fewer, target_triangles) if len(fewer.faces) > target_triangles else fewer
    tell(THINNED)
    return measured(surface, fewer, lambda share: tell(THINNED + (1.0 - THINNED) * share))


def _report(surface: ThinnedSurface, dropped: Dropped) -> SurfaceReport:
    return SurfaceReport(
        surface.mean_deviation_mm, surface.max_deviation_mm, dropped, surface.certified_mm, surface.put_back
    )
