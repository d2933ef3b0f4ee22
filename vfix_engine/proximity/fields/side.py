"""Side of a surface on which a point lies, from the surface alone.

The sign of Bærentzen & Aanæs 2005, "Signed distance computation using the angle weighted pseudonormal", IEEE
Transactions on Visualization and Computer Graphics 11(3), section 3: of the vector from the surface's closest point
along the pseudo-normal of the face, edge or vertex that the closest point lies on.

The side is exact for a closed surface without self-intersections. Otherwise it is that of the nearest face:
correct near an open surface, undefined where its rim is nearest, and reversed where the triangles are oriented inwards.
Triangles without area are ignored.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array, IndexArray
from ...geometry.mesh import TriangleMesh
from ..proximity import Proximity

# A closest point nearer to an edge or corner than this fraction of the longest edge counts as on it. There the
# pseudo-normals of both features give the same sign.
_ON_FEATURE = 1e-6
_ON_SURFACE = 1e-9  # [mm]; below it the sign is determined by rounding


class SurfaceSide:
    """Inside and outside of a tree's mesh with outward normals."""

    def __init__(self, tree: Proximity) -> None:
        self._tree = tree
        self._edge_normals, self._corner_normals = _pseudo_normals(tree.mesh)

    def outside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Mask (n,) of the points (n, 3), in mm, outside; False on the surface and where undefined.

        Raises:
            InputError: points that are not finite or not of that shape.
        """
        places = np.array(points, dtype=np.float64)
        distance, closest, triangle = self._tree.point_distance(places)
        away = np.einsum("ij,ij->i", places - closest, self._normal_at(closest, triangle))
        side: NDArray[np.bool_] = (away > 0.0) & (distance > _ON_SURFACE)
        return side

    def _normal_at(self, closest: Array, triangle: NDArray[np.int32]) -> Array:
        """Pseudo-normals (n, 3), not normalised, of the feature of each triangle (n,) that its point (n, 3) lies on."""
        corners = self._tree.mesh.triangles[triangle]
        along = np.roll(corners, -1, axis=1) - corners
        within = _ON_FEATURE * np.linalg.norm(along, axis=2).max(axis=1)
        to_corner = np.linalg.norm(closest[:, None] - corners, axis=2)
        to_edge = _edge_distance(closest, corners, along)
        # A triangle without area has several nearest edges with different neighbours.
        near = to_edge <= np.minimum(to_edge.min(axis=1) + _ON_SURFACE, within)[:, None]
        at_edge = np.einsum("ni,nij->nj", near, self._edge_normals[triangle])
        normal = np.where(near.any(axis=1)[:, None], at_edge, self._tree.mesh.face_normals[triangle])
        rows, corner = np.arange(len(closest)), to_corner.argmin(axis=1)
        on_corner = to_corner[rows, corner] <= within
        return np.where(on_corner[:, None], self._corner_normals[triangle, corner], normal)


def _edge_distance(points: Array, corners: Array, along: Array) -> Array:
    """Distances (n, 3) from points (n, 3) to the edges of triangles (n, 3, 3), the i-th from corner i to the next."""
    to_point = points[:, None] - corners
    length = np.einsum("nij,nij->ni", along, along)
    t = np.einsum("nij,nij->ni", to_point, along)
    t = np.clip(np.divide(t, length, out=np.zeros_like(t), where=length > 0.0), 0.0, 1.0)
    distance: Array = np.linalg.norm(to_point - t[..., None] * along, axis=2)
    return distance


def _pseudo_normals(mesh: TriangleMesh) -> tuple[Array, Array]:
    """Pseudo-normals (F, 3, 3) of each triangle's edges and (F, 3, 3) of its corners, summed over the mesh.

    Corners with equal coordinates are one vertex, since some files do not share vertices between triangles.
    """
    vertex = _welded(mesh.vertices)[mesh.faces]
    normals = mesh.face_normals
    corner = mesh.triangles
    ahead, behind = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    angle = np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), np.einsum("fij,fij->fi", ahead, behind))
    corners = _summed(vertex, angle[..., None] * normals[:, None])
    following = np.roll(vertex, -1, axis=1)
    pair = np.sort(np.stack([vertex, following], axis=-1), axis=-1).astype(np.int64)
    edge = np.unique(pair[..., 0] * len(mesh.vertices) + pair[..., 1], return_inverse=True)[1]
    edges = _summed(edge.reshape(vertex.shape), np.broadcast_to(normals[:, None], (*vertex.shape, 3)))
    return edges, corners


def _summed(key: IndexArray, values: Array) -> Array:
    """For each key (F, 3) the sum (F, 3, 3) of the values (F, 3, 3) of all equal keys."""
    flat = key.ravel()
    totals: Array = np.empty((int(flat.max()) + 1, 3))
    for k in range(3):
        totals[:, k] = np.bincount(flat, weights=values[..., k].ravel())
    return totals[key]


def _welded(vertices: Array) -> IndexArray:
    """An index (V,) for each vertex (V, 3), equal for equal coordinates."""
    order = np.lexsort(vertices.T)
    placed = vertices[order]
    number: IndexArray = np.zeros(len(vertices), dtype=np.intp)
    number[order[1:]] = np.cumsum((placed[1:] != placed[:-1]).any(axis=1))
    return number
