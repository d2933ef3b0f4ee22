"""From a CT or a surface to the two surfaces of a case: the one the controller keeps away from, and the one on show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.surface import BONE_HU, ThinnedSurface, clean, extract_surface, thin
from vfix_engine.imaging.volume import Volume

# The surface that the margin is kept to: thinning moves it by up to some tenths of a millimetre, as much as the margin,
# so only a CT finer than the controller can use is thinned.
CONTROL_TRIANGLES = 1_000_000
DISPLAY_TRIANGLES = 60_000
MIN_BODY_TRIANGLES = 100  # a speck of noise or a filling's streak; smaller bodies are away
DISPLAY_MIN_BODY_TRIANGLES = 400

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class BoneSurfaces:
    """control, display: surfaces in LPS mm, normals out of bone.

    control_deviation_mm: (mean, largest) distance of the extracted surface's vertices from `control`; zero where
    nothing was thinned. display_deviation_mm: the same of `control`'s vertices from `display`.
    """

    control: TriangleMesh
    display: TriangleMesh
    control_deviation_mm: tuple[float, float]
    display_deviation_mm: tuple[float, float]


def bone_of_volume(volume: Volume, *, progress: Progress) -> BoneSurfaces:
    """Extract, clean and thin the bone of a CT.

    Raises ImageError when there is no bone.
    """
    progress("Finding the bone", 0.0)
    surface = extract_surface(volume, BONE_HU)
    progress("Cleaning the surface", 0.35)
    surface = clean(surface, min(MIN_BODY_TRIANGLES, len(surface.faces)))
    progress("Thinning the surface", 0.45)
    control = thin(surface, CONTROL_TRIANGLES)
    progress(
        _thinned_words(len(surface.faces), control) + "; making the picture of it",
        0.75,
    )
    return _with_display(control.mesh, (control.mean_deviation_mm, control.max_deviation_mm))


def _thinned_words(before: int, surface: ThinnedSurface) -> str:
    after = len(surface.mesh.faces)
    if after == before:
        return f"{before:,} triangles, kept whole"
    return f"{before:,} triangles, thinned to {after:,} ({surface.max_deviation_mm:.2f} mm off at most)"


def bone_of_surface(surface: TriangleMesh, *, progress: Progress) -> BoneSurfaces:
    """A surface that was made elsewhere: kept triangle by triangle for the controller, thinned for display only."""
    progress("Making the picture of it", 0.0)
    return _with_display(surface, (0.0, 0.0))


def _with_display(control: TriangleMesh, deviation: tuple[float, float]) -> BoneSurfaces:
    if len(control.faces) <= DISPLAY_TRIANGLES:
        return BoneSurfaces(control, control, deviation, (0.0, 0.0))
    display = thin(control, DISPLAY_TRIANGLES)
    return BoneSurfaces(control, display.mesh, deviation, (display.mean_deviation_mm, display.max_deviation_mm))
