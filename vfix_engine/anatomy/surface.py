"""Isosurface of a CT by marching cubes, slab by slab, and removal of small components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.arrays import Array, Int32Array
from vfix_engine.errors import ImageError, MeshError
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.geometry.mesh import TriangleMesh

SLAB_SLICES = 50  # slices processed at a time: a fifth of the memory of the whole, and somewhat faster


@dataclass(frozen=True)
class Dropped:
    """Components removed from a surface: their number, their triangles, and the extent of the largest.

    extent_mm: largest diagonal of a component's bounding box in LPS.
    """

    pieces: int = 0
    triangles: int = 0
    extent_mm: float = 0.0


@dataclass(frozen=True)
class CleanedSurface:
    """Result of `clean`."""

    mesh: TriangleMesh
    dropped: Dropped


def extract_surface(
    volume: Volume,
    threshold_hu: float = BONE_HU,
    region: npt.NDArray[np.float64] | None = None,
    *,
    slab_slices: int = SLAB_SLICES,
    tell: Callable[[float], None] = lambda share: None,
) -> TriangleMesh:
    """Extract the isosurface in LPS mm with outward normals (marching cubes, Lewiner et al. 2003, as in scikit-image).

    The surface is open where the volume or the region cuts through bone, and closed elsewhere. Marching cubes leaves
    holes at voxels whose value equals the level, so the level is half a Hounsfield unit below the threshold, a value
    that no voxel has.

    Args:
        threshold_hu: voxels of at least this value are bone.
        region: (2, 3) LPS corners [mm] of a box; None is the whole volume.
        slab_slices: layers of cells processed at a time; the surface does not depend on it.
        tell: called with the completed fraction.

    Raises:
        ImageError: there is no bone, or the region lies outside the volume.
    """
    first, hu = _cropped(volume, region)
    low, high = int(hu.min()), int(hu.max())
    if not low < threshold_hu <= high:
        raise ImageError(f"no bone surface at {threshold_hu:g} HU: the values run from {low} to {high}.")
    kji, faces = _by_slab(hu, float(np.ceil(threshold_hu)) - 0.5, max(1, int(slab_slices)), tell)
    vertices = volume.index_to_lps(kji[:, ::-1] + first)
    # With 'descent' (denser inside) and corners in the order i, j, k, the triangles are oriented outwards; a
    # left-handed direction matrix mirrors them.
    if np.linalg.det(volume.direction) < 0:
        faces = faces[:, ::-1]
    return TriangleMesh(vertices, np.ascontiguousarray(faces, dtype=np.int32))


def _by_slab(
    hu: npt.NDArray[np.int16], level: float, slab: int, tell: Callable[[float], None]
) -> tuple[Array, Int32Array]:
    """Vertices (V, 3) as indices k, j, i, and faces (F, 3), of all slabs, merged in their common layers."""
    from skimage.measure import marching_cubes  # imported here: slow to load

    vertices, faces, count = list[Array](), list[Int32Array](), 0
    open_vertices, open_numbers = np.zeros((0, 3)), np.zeros(0, dtype=np.int64)  # last layer of the previous slab
    for start in range(0, len(hu) - 1, slab):
        end = min(start + slab, len(hu) - 1)
        block = hu[start : end + 1].astype(np.float32)
        tell(start / len(hu))
        if not block.min() < level < block.max():
            open_vertices, open_numbers = np.zeros((0, 3)), np.zeros(0, dtype=np.int64)
            continue
        found, corners, _, _ = marching_cubes(block, level, gradient_direction="descent", allow_degenerate=True)
        placed = found.astype(np.float64)
        placed[:, 0] += start
        number = np.full(len(placed), -1, dtype=np.int64)
        bottom = np.flatnonzero(placed[:, 0] == start)
        number[bottom] = _matching(placed[bottom], open_vertices, open_numbers)
        fresh = number < 0
        number[fresh] = count + np.arange(int(fresh.sum()))
        vertices.append(placed[fresh])
        faces.append(number[corners].astype(np.int32))
        count += int(fresh.sum())
        top = np.flatnonzero(placed[:, 0] == end)
        open_vertices, open_numbers = placed[top], number[top]
    return np.concatenate(vertices), np.concatenate(faces)


def _matching(places: Array, known: Array, numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Index (n,) of the known vertex with the same coordinates for each point (n, 3), or -1."""
    if not len(places) or not len(known):
        return np.full(len(places), -1, dtype=np.int64)
    both = np.concatenate([known, places])
    _, group = np.unique(both, axis=0, return_inverse=True)
    group = group.reshape(-1)
    of_group = np.full(int(group.max()) + 1, -1, dtype=np.int64)
    of_group[group[: len(known)]] = numbers
    return of_group[group[len(known) :]]


def compact(vertices: Array, faces: npt.NDArray[np.integer]) -> tuple[Array, Int32Array]:
    """Remove vertices that no face uses; return vertices (V, 3) and faces (F, 3)."""
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    return vertices[used], (np.cumsum(used, dtype=np.int32) - 1)[faces]


def clean(mesh: TriangleMesh, min_body_triangles: int) -> CleanedSurface:
    """Remove components with fewer triangles, unused vertices and triangles without area.

    Raises:
        MeshError: nothing is left.
    """
    from scipy.sparse import coo_matrix  # as above
    from scipy.sparse.csgraph import connected_components

    faces = mesh.faces[(np.linalg.norm(mesh.face_normals, axis=1) > 0.0)]
    count = len(mesh.vertices)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(count, count))
    _, body_of_vertex = connected_components(graph, directed=False)
    body = body_of_vertex[faces[:, 0]]
    kept = np.bincount(body, minlength=count)[body] >= min_body_triangles
    if not kept.any():
        raise MeshError(f"no body of the surface has {min_body_triangles} triangles.")
    dropped = _dropped(mesh.vertices[faces[~kept]], body[~kept])
    faces = faces[kept]
    return CleanedSurface(TriangleMesh(*compact(mesh.vertices, faces)), dropped)


def _dropped(triangles: npt.NDArray[np.float64], body: npt.NDArray[np.int32]) -> Dropped:
    """Summarise the triangles (n, 3, 3) of removed components (n,)."""
    if not len(triangles):
        return Dropped()
    bodies, number = np.unique(body, return_inverse=True)
    low, high = np.full((len(bodies), 3), np.inf), np.full((len(bodies), 3), -np.inf)
    np.minimum.at(low, number, triangles.min(axis=1))
    np.maximum.at(high, number, triangles.max(axis=1))
    return Dropped(len(bodies), len(triangles), float(np.linalg.norm(high - low, axis=1).max()))


def _cropped(
    volume: Volume, region: npt.NDArray[np.float64] | None
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int16]]:
    """((3,) first index i, j, k, the voxels from there) of the smallest index box that contains the region."""
    if region is None:
        return np.zeros(3), volume.hu
    corners = np.stack(np.meshgrid(*np.asarray(region, dtype=np.float64).T, indexing="ij"), axis=-1).reshape(-1, 3)
    indices = volume.lps_to_index(corners)
    counts = np.array(volume.hu.shape[::-1])
    low = np.clip(np.floor(indices.min(axis=0)).astype(int), 0, counts - 2)
    high = np.clip(np.ceil(indices.max(axis=0)).astype(int) + 1, low + 2, counts)
    if (indices.max(axis=0) < 0).any() or (indices.min(axis=0) > counts - 1).any():
        raise ImageError("the region lies outside the volume.")
    return low.astype(np.float64), volume.hu[low[2] : high[2], low[1] : high[1], low[0] : high[0]]
