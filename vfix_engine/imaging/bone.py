"""From a CT or a surface to the two surfaces of a case: the one the controller keeps away from, and the one on show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.surface import BONE_HU, Dropped, ThinnedSurface, clean, extract_surface, thin
from vfix_engine.imaging.volume import Volume

# The surface that the margin is kept to: thinning moves it by up to most of a millimetre, more than the margin, so only
# a CT finer than the controller can use is thinned.
CONTROL_TRIANGLES = 1_000_000
DISPLAY_TRIANGLES = 60_000
MIN_BODY_TRIANGLES = 100  # a speck of noise or a filling's streak; smaller bodies are away
USUAL_SLICE_MM = 1.0  # slices for navigation in the nose are no further apart
SLICE_SHARE = 0.5  # of the distance between slices further apart than that: so far bone may lie from its surface

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class SurfaceReport:
    """How far a surface may lie from what it was made of, and what it lacks.

    mean_deviation_mm, max_deviation_mm: of thinning, at every vertex in both directions, as `ThinnedSurface` has them;
    zero where nothing was thinned. dropped: loose pieces that were taken for noise.
    """

    mean_deviation_mm: float
    max_deviation_mm: float
    dropped: Dropped


@dataclass(frozen=True)
class BoneSurfaces:
    """control, display: surfaces in LPS mm, normals out of bone.

    control_report: of `control` against the extracted surface. display_report: of `display` against `control`.
    """

    control: TriangleMesh
    display: TriangleMesh
    control_report: SurfaceReport
    display_report: SurfaceReport


def slices_may_hide_mm(spacing_mm: float) -> float:
    """How far [mm] bone may lie from its surface in a CT whose voxels are `spacing_mm` apart where they are furthest.

    Zero up to 1 mm, which is usual; above it half of the distance. On the synthetic head at least 95 % of the bone of
    0.5 mm slices lay no further than that from the bone of the same slices, averaged to 1.5 to 5 mm; the rest did.
    """
    return SLICE_SHARE * spacing_mm if spacing_mm > USUAL_SLICE_MM else 0.0


def bone_of_volume(volume: Volume, *, progress: Progress) -> BoneSurfaces:
    """Extract, clean and thin the bone of a CT.

    Raises ImageError when there is no bone.
    """
    progress("Finding the bone", 0.0)
    surface = extract_surface(volume, BONE_HU)
    progress("Cleaning the surface", 0.35)
    cleaned = clean(surface, min(MIN_BODY_TRIANGLES, len(surface.faces)))
    progress("Thinning the surface", 0.45)
    control = thin(cleaned.mesh, CONTROL_TRIANGLES)
    progress(
        _thinned_words(len(cleaned.mesh.faces), control) + "; making the picture of it",
        0.75,
    )
    return _with_display(control, cleaned.dropped)


def _thinned_words(before: int, surface: ThinnedSurface) -> str:
    after = len(surface.mesh.faces)
    if after == before:
        return f"{before:,} triangles, kept whole"
    return f"{before:,} triangles, thinned to {after:,} ({surface.max_deviation_mm:.2f} mm off at most)"


def bone_of_surface(surface: TriangleMesh, *, progress: Progress) -> BoneSurfaces:
    """A surface that was made elsewhere: kept triangle by triangle for the controller, thinned for display only."""
    progress("Making the picture of it", 0.0)
    return _with_display(ThinnedSurface(surface, 0.0, 0.0), Dropped())


def _with_display(control: ThinnedSurface, dropped: Dropped) -> BoneSurfaces:
    display = thin(control.mesh, DISPLAY_TRIANGLES)
    return BoneSurfaces(control.mesh, display.mesh, _report(control, dropped), _report(display, Dropped()))


def _report(surface: ThinnedSurface, dropped: Dropped) -> SurfaceReport:
    return SurfaceReport(surface.mean_deviation_mm, surface.max_deviation_mm, dropped)
