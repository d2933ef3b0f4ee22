"""Bone surface out of a CT: marching cubes at a threshold, small bodies away, thinned with the deviation measured."""

from __future__ import annotations

from dataclasses import dataclass

import fast_simplification
import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError, MeshError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.proximity import ProximityTree
from vfix_engine.imaging.volume import Volume

BONE_HU = 250.0
_AGGRESSIVENESS = 5.0  # of the edge collapse, 0 to 10: slower and closer to the original than its default of 7


@dataclass(frozen=True)
class ThinnedSurface:
    """A thinned surface and how far [mm] it and the original lie apart, measured at every vertex of both.

    mean_deviation_mm: of the vertices of one from the other's triangles, the larger of the two directions.
    max_deviation_mm: the largest of both directions. Between vertices the surfaces may lie further apart.
    """

    mesh: TriangleMesh
    mean_deviation_mm: float
    max_deviation_mm: float


@dataclass(frozen=True)
class Dropped:
    """Loose pieces that were left out of a surface: how many, their triangles, and the largest one's extent.

    extent_mm: the largest diagonal of a piece's box along the axes of LPS; no piece reaches further than that.
    """

    pieces: int = 0
    triangles: int = 0
    extent_mm: float = 0.0


@dataclass(frozen=True)
class CleanedSurface:
    mesh: TriangleMesh
    dropped: Dropped


def extract_surface(
    volume: Volume, threshold_hu: float = BONE_HU, region: npt.NDArray[np.float64] | None = None
) -> TriangleMesh:
    """Isosurface in LPS mm, normals out of the bone.

    threshold_hu: bone is what is denser.
    region: (2, 3) LPS corners [mm] of the box to stay in; None is the whole volume.
    The surface is open where the volume or the region cuts through bone.

    Raises ImageError when there is no bone in it.
    """
    from skimage.measure import marching_cubes  # slow to import, and a start needs none of it

    first, hu = _cropped(volume, region)
    if not hu.min() < threshold_hu < hu.max():
        raise ImageError(f"no bone surface at {threshold_hu:g} HU: the values run from {hu.min()} to {hu.max()}.")
    kji, faces, _, _ = marching_cubes(
        hu.astype(np.float32), threshold_hu, gradient_direction="descent", allow_degenerate=False
    )
    vertices = volume.index_to_lps(kji[:, ::-1].astype(np.float64) + first)
    # With 'descent' (denser inside) and the corners taken in the order i, j, k, the triangles turn outwards; a
    # left-handed direction matrix mirrors them.
    if np.linalg.det(volume.direction) < 0:
        faces = faces[:, ::-1]
    return TriangleMesh(vertices, np.ascontiguousarray(faces, dtype=np.int32))


def clean(mesh: TriangleMesh, min_body_triangles: int) -> CleanedSurface:
    """The mesh without bodies of fewer triangles, unused vertices and triangles of no area; and what bodies those were.

    Raises MeshError when nothing is left.
    """
    from scipy.sparse import coo_matrix  # as above
    from scipy.sparse.csgraph import connected_components

    faces = mesh.faces[(np.linalg.norm(mesh.face_normals, axis=1) > 0.0)]
    count = len(mesh.vertices)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_matrix((np.ones(len(edges), dtype=np.int8), (edges[:, 0], edges[:, 1])), shape=(count, count))
    _, body_of_vertex = connected_components(graph, directed=False)
    body = body_of_vertex[faces[:, 0]]
    stays = np.bincount(body, minlength=count)[body] >= min_body_triangles
    if not stays.any():
        raise MeshError(f"no body of the surface has {min_body_triangles} triangles.")
    dropped = _dropped(mesh.vertices[faces[~stays]], body[~stays])
    faces = faces[stays]
    used = np.zeros(count, dtype=bool)
    used[faces] = True
    compact = (np.cumsum(used, dtype=np.int32) - 1)[faces]
    return CleanedSurface(TriangleMesh(mesh.vertices[used], compact), dropped)


def _dropped(triangles: npt.NDArray[np.float64], body: npt.NDArray[np.int32]) -> Dropped:
    """What the triangles (n, 3, 3) of dropped bodies (n,) come to."""
    if not len(triangles):
        return Dropped()
    bodies, number = np.unique(body, return_inverse=True)
    low, high = np.full((len(bodies), 3), np.inf), np.full((len(bodies), 3), -np.inf)
    np.minimum.at(low, number, triangles.min(axis=1))
    np.maximum.at(high, number, triangles.max(axis=1))
    return Dropped(len(bodies), len(triangles), float(np.linalg.norm(high - low, axis=1).max()))


def thin(mesh: TriangleMesh, target_triangles: int) -> ThinnedSurface:
    """Quadric edge collapse to about the target, and how far the result and the original lie apart.

    A mesh that is small enough already is returned as it is.
    """
    if len(mesh.faces) <= target_triangles:
        return ThinnedSurface(mesh, 0.0, 0.0)
    vertices, faces = fast_simplification.simplify(
        np.array(mesh.vertices), np.array(mesh.faces), target_count=target_triangles, agg=_AGGRESSIVENESS
    )
    thinned = clean(TriangleMesh(vertices.astype(np.float64), faces.astype(np.int32)), 1).mesh
    deviations = [ProximityTree(to).point_distance(of.vertices)[0] for of, to in ((mesh, thinned), (thinned, mesh))]
    return ThinnedSurface(thinned, float(max(d.mean() for d in deviations)), float(max(d.max() for d in deviations)))


def _cropped(
    volume: Volume, region: npt.NDArray[np.float64] | None
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int16]]:
    """((3,) first index i, j, k, the voxels from there) of the smallest index box that holds the region."""
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
