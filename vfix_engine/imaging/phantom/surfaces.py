"""Surfaces of the phantom: the bone around the nose out of its CT, and smooth ones for display out of the distances."""

from __future__ import annotations

from collections.abc import Callable

import fast_simplification
import numpy as np
from skimage.measure import marching_cubes

from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.phantom.anatomy import Head
from vfix_engine.imaging.phantom.blending import Field
from vfix_engine.imaging.phantom.generate import generate_fields
from vfix_engine.imaging.phantom.shapes import Box
from vfix_engine.imaging.phantom.space import Space
from vfix_engine.imaging.surface import ThinnedSurface, clean, extract_surface, thin
from vfix_engine.imaging.volume import AIR_HU, Volume

NOSE_TRIANGLES = 180_000
SKULL_TRIANGLES = 60_000
SKIN_TRIANGLES = 30_000
HALF_SKULL_FROM_X = 1.9  # [mm] left of the midline: the septum stays away, the left lateral wall of the nose is seen
_SMALLEST_BODY = 400  # [triangles] of the surface before thinning
_COORDINATE_STEP = 2.0**-10  # [mm] vertices are rounded to this: the files pack better


def bone_around_nose(ct: Volume) -> ThinnedSurface:
    """Closed bone surface of the nose box at the bone threshold; where the box cuts bone it is closed flat."""
    padded = np.pad(ct.hu, 1, constant_values=AIR_HU)
    closed = Volume(padded, ct.origin - ct.spacing, ct.spacing, ct.direction)
    thinned = thin(clean(extract_surface(closed), _SMALLEST_BODY), NOSE_TRIANGLES)
    return ThinnedSurface(_rounded(thinned.mesh), thinned.mean_deviation_mm, thinned.max_deviation_mm)


def skull(spacing_mm: float) -> TriangleMesh:
    """The whole skull with its sinuses filled: what is seen from outside."""
    return _display(lambda tissues, _: np.minimum(tissues.bone, tissues.sinuses), spacing_mm, SKULL_TRIANGLES)


def half_skull(spacing_mm: float) -> TriangleMesh:
    """The left half, cut in a sagittal plane and closed there."""
    box = ((HALF_SKULL_FROM_X - 2 * spacing_mm, -60.0, -200.0), (200.0, 300.0, 200.0))

    def left(tissues: Head, space: Space) -> Field:
        plane = (HALF_SKULL_FROM_X - space.axes[0]).astype(np.float32)[None, None, :]
        return np.maximum(tissues.bone, plane)

    return _display(left, spacing_mm, SKULL_TRIANGLES, box)


def skin(spacing_mm: float) -> TriangleMesh:
    """The outer skin; the airway behind the nostrils is left out."""
    return _display(lambda tissues, _: tissues.skin, spacing_mm, SKIN_TRIANGLES)


def _display(
    pick: Callable[[Head, Space], Field], spacing_mm: float, triangles: int, box: Box | None = None
) -> TriangleMesh:
    """Zero level of a distance, which is smooth between the voxels where a CT has steps, in few triangles."""
    distance, origin = generate_fields(spacing_mm, pick, box)
    outside = np.pad(distance, 1, constant_values=spacing_mm)
    kji, faces, _, _ = marching_cubes(outside, 0.0, allow_degenerate=False)
    vertices = kji[:, ::-1].astype(np.float64) * spacing_mm + origin - spacing_mm
    whole = clean(TriangleMesh(vertices, faces[:, ::-1]), _SMALLEST_BODY)
    points, corners = fast_simplification.simplify(
        np.array(whole.vertices), np.array(whole.faces), target_count=triangles, agg=5.0
    )
    return _rounded(clean(TriangleMesh(points, corners), 1))


def _rounded(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(np.rint(mesh.vertices / _COORDINATE_STEP) * _COORDINATE_STEP, mesh.faces)
