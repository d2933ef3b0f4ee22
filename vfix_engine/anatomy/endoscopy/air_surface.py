"""The surface of air against tissue as a CT shows it, for the picture of an endoscope. For display only.

Its level is `TISSUE_HU`, as everywhere in this package, of the CT blurred by `BLUR_MM`, which takes noise away and
leaves walls where they are. Normals come from the gradient of that CT, so that they are smooth whatever the triangles
are. The surface is open where its box or the scan ends. Where bone is to be removed there is air.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.anatomy.bone import CLUSTERED_FROM, CLUSTERED_TRIANGLES
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.surface import clean, extract_surface
from vfix_engine.anatomy.thinning import clustered, collapsed
from vfix_engine.arrays import Array
from vfix_engine.errors import ImageError, MeshError
from vfix_engine.files.volume import AIR_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shape_surface import border_triangles
from vfix_engine.geometry.shapes import Shape
from vfix_engine.progress import ProgressCallback, no_progress

AIR_TRIANGLES = 180_000
BLUR_MM = 0.4  # standard deviation of the blur
FINE_MM = 0.5  # coarser voxels are interpolated to this size first
BEYOND_MM = 25.0  # of a path and its targets, that the box holds at least
CORNER_STEP_MM = 20.0  # corners of the box are multiples: a path that is edited mostly keeps its box
MOST_VOXELS = 50_000_000  # of the box at that size: 180 mm on each side, which takes about a gigabyte
_LEAST_TRIANGLES = 300  # smaller components are noise
_MARGIN_VOXELS = 3  # around the box, for the blur and the gradient
_NO_AIR = "this part of the CT shows no air against tissue, so an endoscope sees nothing there."
# Fractions of the time until each stage, on the nose of the synthetic head.
_BLURRED, _FOUND, _THINNED = 0.25, 0.5, 0.9


@dataclass(frozen=True, eq=False)
class AirSurface:
    """mesh: LPS mm. normals: unit vectors (V, 3) at its vertices. Both point out of tissue, into air."""

    mesh: TriangleMesh
    normals: Array


def box_about(places: npt.ArrayLike) -> Array:
    """Corners (2, 3) of a box in LPS mm that holds places (n, 3) with `BEYOND_MM` around them."""
    points = np.asarray(places, dtype=np.float64).reshape(-1, 3)
    low, high = points.min(axis=0) - BEYOND_MM, points.max(axis=0) + BEYOND_MM
    return np.stack([np.floor(low / CORNER_STEP_MM), np.ceil(high / CORNER_STEP_MM)]) * CORNER_STEP_MM


def air_surface(
    volume: Volume,
    box: Array,
    *,
    removed: Sequence[Shape] = (),
    triangles: int | None = AIR_TRIANGLES,
    progress: ProgressCallback = no_progress,
) -> AirSurface:
    """Extract the surface within a box (2, 3) in LPS mm, with about so many triangles at most; None: with all.

    removed: spheres, capsules and boxes, LPS mm, in which all is air, as after an operation that removes bone there.

    Raises:
        ImageError: there is no air against tissue in the box, or it has more than `MOST_VOXELS` of `FINE_MM`.
    """
    progress("Reading the CT about the path", 0.0)
    fine = _blurred(_without(_finer(_cropped(volume, box)), removed))
    progress("Finding the border of air and tissue", _BLURRED)
    mesh = _cleaned(fine)
    if triangles is not None and len(mesh.faces) > triangles:
        progress(f"Thinning {len(mesh.faces):,} triangles", _FOUND)
        fewer = clustered(mesh, CLUSTERED_TRIANGLES) if len(mesh.faces) > CLUSTERED_FROM else mesh
        mesh = collapsed(fewer, triangles)
    progress("Finding the normals", _THINNED)
    return AirSurface(mesh, _normals(fine, mesh.vertices))


def _cropped(volume: Volume, box: Array) -> Volume:
    """The voxels of a box and a few around it. Raises ImageError where the scan does not reach it."""
    corners = np.stack(np.meshgrid(*np.asarray(box, dtype=np.float64).T, indexing="ij"), axis=-1).reshape(-1, 3)
    index = volume.lps_to_index(corners)
    last = np.array(volume.hu.shape[::-1]) - 1
    low = np.clip(np.floor(index.min(axis=0)).astype(int) - _MARGIN_VOXELS, 0, last)
    high = np.clip(np.ceil(index.max(axis=0)).astype(int) + _MARGIN_VOXELS, 0, last)
    if (high - low < 2).any():
        raise ImageError("the CT does not reach that part of the head.")
    part = tuple(slice(a, b + 1) for a, b in zip(low[::-1], high[::-1], strict=True))
    return Volume(volume.hu[part], volume.index_to_lps(low), volume.spacing, volume.direction)


def _finer(volume: Volume) -> Volume:
    """The volume with voxels of `FINE_MM` at most, interpolated by cubic splines."""
    from scipy import ndimage  # imported here: slow to load

    counts = np.array(volume.hu.shape[::-1])
    wanted = np.where(
        volume.spacing > FINE_MM * 1.001, np.ceil((counts - 1) * volume.spacing / FINE_MM).astype(int) + 1, counts
    )
    if math.prod(wanted.tolist()) > MOST_VOXELS:
        raise ImageError("path and targets are too far apart for one picture; delete targets far from the path.")
    if (wanted == counts).all():
        return volume
    factors = tuple(float(factor) for factor in (wanted / counts)[::-1])
    found = ndimage.zoom(volume.hu.astype(np.float32), factors, order=3, mode="nearest", grid_mode=False)
    spacing = volume.spacing * (counts - 1) / (np.array(found.shape[::-1]) - 1)
    return Volume(_int16(found), volume.origin, spacing, volume.direction)


def _without(volume: Volume, removed: Sequence[Shape]) -> Volume:
    """The volume with air inside of shapes; a voxel that a border cuts has its share of it."""
    if not removed:
        return volume
    hu, last = volume.hu.copy(), np.array(volume.hu.shape[::-1]) - 1
    for shape in removed:
        at = volume.lps_to_index(border_triangles(shape, 1.0).reshape(-1, 3))
        low, high = np.floor(at.min(axis=0)).astype(int) - 1, np.ceil(at.max(axis=0)).astype(int) + 1
        low, high = np.clip(low, 0, last), np.clip(high, 0, last)
        axes = [np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
        for k in axes[2]:  # a slice at a time: the shape may be as large as the box
            index = np.stack(np.meshgrid(axes[0], axes[1], [k], indexing="ij"), axis=-1).reshape(-1, 3)
            inside = np.clip(0.5 - signed_distance(shape, volume.index_to_lps(index)) / volume.spacing.min(), 0.0, 1.0)
            part = hu[k, low[1] : high[1] + 1, low[0] : high[0] + 1]
            part[:] = np.rint(part + inside.reshape(len(axes[0]), -1).T * (AIR_HU - part))
    return Volume(hu, volume.origin, volume.spacing, volume.direction)


def _blurred(volume: Volume) -> Volume:
    from scipy import ndimage  # as above

    found = ndimage.gaussian_filter(volume.hu.astype(np.float32), BLUR_MM / volume.spacing[::-1], mode="nearest")
    return Volume(_int16(found), volume.origin, volume.spacing, volume.direction)


def _int16(values: npt.NDArray[np.float32]) -> npt.NDArray[np.int16]:
    limits = np.iinfo(np.int16)
    return np.clip(np.rint(values), limits.min, limits.max).astype(np.int16)


def _cleaned(volume: Volume) -> TriangleMesh:
    """The isosurface without small components. Raises ImageError without any."""
    try:
        mesh = extract_surface(volume, TISSUE_HU)
        return clean(mesh, _LEAST_TRIANGLES).mesh
    except (ImageError, MeshError):
        raise ImageError(_NO_AIR) from None


def _normals(volume: Volume, places: Array) -> Array:
    """Unit vectors (n, 3) in LPS along which the CT gets less dense."""
    h = 0.5 * volume.spacing.min()
    kept_in = volume.bounds
    slope = np.empty_like(places)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = h
        ahead, behind = (np.clip(places + sign * step, *kept_in) for sign in (1.0, -1.0))
        slope[:, axis] = volume.sample(behind) - volume.sample(ahead)
    normals: Array = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
    return normals
