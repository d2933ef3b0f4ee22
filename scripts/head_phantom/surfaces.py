"""Surfaces of the phantom: the bone around the nose from its CT, and smooth ones for display from the distances."""

from __future__ import annotations

from collections.abc import Callable

import fast_simplification
import numpy as np
import numpy.typing as npt
from skimage.measure import marching_cubes

from head_phantom.anatomy import Head
from head_phantom.blending import Field, without
from head_phantom.generate import generate_fields
from head_phantom.shapes import Box
from head_phantom.space import HIGH, LOW, Space
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.surface import Dropped, clean, extract_surface
from vfix_engine.anatomy.thinning import collapsed, within
from vfix_engine.files.volume import AIR_HU, BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh

NOSE_TRIANGLES = 180_000
BONE_TOLERANCE_MM = 0.05  # from vertices of the CT's own surface; parts that are farther away are restored
SKULL_TRIANGLES = 60_000
SKIN_TRIANGLES = 30_000
HALF_SKULL_FROM_X = 1.9  # [mm] left of the midline: the septum stays away, the left lateral wall of the nose is seen
_SMALLEST_BODY = 400  # [triangles] of the surface before thinning
_FAR_OUTSIDE = 1e3  # [mm] value beyond the block, which closes the surface exactly in the plane of a cut
_THINNEST_WALL = np.float32(0.95)  # [mm] thinner bone would have holes at the spacing of the display
_FLAT = 0.05  # [mm]
_COORDINATE_STEP = 2.0**-10  # [mm] vertices are rounded to this, so that the files compress better


def bone_around_nose(ct: Volume, triangles: int = NOSE_TRIANGLES) -> tuple[TriangleMesh, SurfaceReport]:
    """Return the bone surface of the nose box at the bone threshold, and its error against the CT's own surface.

    The surface is closed flat where the box cuts bone. Small components, and parts that thinning moves too far, are
    restored.
    """
    padded = np.pad(ct.hu, 1, constant_values=AIR_HU)
    closed = Volume(padded, ct.origin - ct.spacing, ct.spacing, ct.direction)
    whole = extract_surface(closed)
    thinned = _rounded(collapsed(clean(_in_one_piece(closed), _SMALLEST_BODY).mesh, triangles))
    exact = within(whole, thinned, BONE_TOLERANCE_MM)
    certified = (exact.certified_mm or 0.0) + _COORDINATE_STEP  # restored parts are rounded as well
    report = SurfaceReport(
        exact.mean_deviation_mm, exact.max_deviation_mm, Dropped(), round(certified, 3), exact.put_back
    )
    return _rounded(exact.mesh), report


def _in_one_piece(ct: Volume) -> TriangleMesh:
    """The isosurface with its vertices in another order than `extract_surface`, from which edge collapse would go on
    to other triangles: those of the shipped file stay as they are."""
    kji, faces, _, _ = marching_cubes(
        ct.hu.astype(np.float32), BONE_HU, gradient_direction="descent", allow_degenerate=False
    )
    return TriangleMesh(ct.index_to_lps(kji[:, ::-1].astype(np.float64)), faces)


def skull(spacing_mm: float) -> TriangleMesh:
    """Return the whole skull with its sinuses filled, as seen from outside."""
    return _display(lambda tissues, _: np.minimum(tissues.bone, tissues.sinuses), spacing_mm, SKULL_TRIANGLES)


def half_skull(spacing_mm: float) -> TriangleMesh:
    """Return the left half, cut in a sagittal plane and closed there."""
    left = ((HALF_SKULL_FROM_X, LOW[1], LOW[2]), (HIGH[0], HIGH[1], HIGH[2]))

    def bone_with_antral_wall(tissues: Head, _: Space) -> Field:
        wall = np.maximum(tissues.antra - _THINNEST_WALL, -tissues.antra)
        thickened: Field = np.minimum(tissues.bone, wall)
        return thickened

    return _display(bone_with_antral_wall, spacing_mm, SKULL_TRIANGLES, left)


def skin(spacing_mm: float) -> TriangleMesh:
    """Return the outer skin with the nostrils, without the airway behind them."""

    def skin_and_nostrils(tissues: Head, space: Space) -> Field:
        return without(tissues.skin, np.maximum(tissues.nostrils, space.z - 5), 1.0)

    return _display(skin_and_nostrils, spacing_mm, SKIN_TRIANGLES)


def _display(
    pick: Callable[[Head, Space], Field], spacing_mm: float, triangles: int, box: Box | None = None
) -> TriangleMesh:
    """Return the zero level of a distance in few triangles; it is smooth between voxels, where a CT has steps."""
    distance, origin = generate_fields(spacing_mm, pick, box)
    outside = np.pad(distance, 1, constant_values=_FAR_OUTSIDE)
    kji, faces, _, _ = marching_cubes(outside, 0.0, allow_degenerate=False)
    vertices = kji[:, ::-1].astype(np.float64) * spacing_mm + origin - spacing_mm
    whole = clean(TriangleMesh(vertices, faces[:, ::-1]), _SMALLEST_BODY).mesh
    points, corners = fast_simplification.simplify(
        np.array(whole.vertices), np.array(whole.faces), target_count=triangles, agg=5.0
    )
    thinned = clean(TriangleMesh(points, corners), 1).mesh
    return _rounded(_creased(thinned, np.stack([origin, origin + spacing_mm * (np.array(distance.shape[::-1]) - 1)])))


def _creased(mesh: TriangleMesh, block: npt.NDArray[np.float64]) -> TriangleMesh:
    """Separate the corners of faces in the planes of a block (2, 3), so that a cut is shaded flat."""
    on_plane = np.abs(mesh.triangles[:, :, None, :] - block).max(axis=1) < _FLAT  # (F, 2, 3)
    cut = on_plane.any(axis=(1, 2))
    of_cut, corners = np.unique(mesh.faces[cut], return_inverse=True)
    faces = mesh.faces.copy()
    faces[cut] = len(mesh.vertices) + corners.reshape(-1, 3)
    return TriangleMesh(np.concatenate([mesh.vertices, mesh.vertices[of_cut]]), faces)


def _rounded(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(np.rint(mesh.vertices / _COORDINATE_STEP) * _COORDINATE_STEP, mesh.faces)
