"""A lumen's wall from inside: ray casting through Embree, and the distance to it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...errors import PathwayError
from ...geometry.mesh import TriangleMesh
from ...proximity.fields.side import SurfaceSide
from ...proximity.proximity import ProximityTree


class Wall:
    """A lumen's surface. Its triangles are consistently oriented, inwards or outwards."""

    def __init__(self, mesh: TriangleMesh) -> None:
        import trimesh  # imported here: slow to load
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        self.mesh = mesh
        surface = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, validate=False)
        self._rays: Any = RayMeshIntersector(surface)
        self._tree = ProximityTree(mesh)
        self._side = SurfaceSide(self._tree)

    def seen(self, origin: Array, direction: Array) -> tuple[Array, NDArray[np.int8]]:
        """Find the first intersections of rays with the wall.

        Args:
            origin, direction: (…, 3), mm and unit vectors.

        Returns:
            distance: (…,) mm, infinite if a ray leaves through an opening.
            side: (…,) 1 if it meets the wall along the triangle's normal, −1 against it, 0 if it meets none.
        """
        start = np.ascontiguousarray(np.broadcast_to(origin, direction.shape).reshape(-1, 3))
        rays = np.ascontiguousarray(direction.reshape(-1, 3))
        triangle = np.asarray(self._rays.intersects_first(start, rays))
        hit = triangle >= 0
        # Embree uses single precision: it returns the triangle, and the distance to its plane is computed here.
        normal = self.mesh.face_normals[triangle[hit]]
        steep = np.einsum("ij,ij->i", normal, rays[hit])
        to_plane = np.einsum("ij,ij->i", normal, self.mesh.triangles[triangle[hit], 0] - start[hit])
        distance, side = np.full(len(rays), np.inf), np.zeros(len(rays), dtype=np.int8)
        met = np.divide(to_plane, steep, out=np.zeros_like(steep), where=np.abs(steep) > 1e-12)
        distance[hit], side[hit] = np.maximum(met, 0.0), np.sign(steep)
        return distance.reshape(direction.shape[:-1]), side.reshape(direction.shape[:-1])

    def free(self, eye: Array, point: Array) -> bool:
        """Whether an eye (3,) sees a point (3,), mm: no wall is between them, and they are not the same point."""
        ahead = point - eye
        away = float(np.linalg.norm(ahead))
        return away > 0.0 and float(self.seen(eye, ahead / away)[0]) >= away

    def clearance(self, points: Array, outward: int) -> tuple[Array, Array]:
        """Distance (n,) of points (n, 3) to the wall in mm, negative outside, and unit vectors (n, 3) into the lumen.

        outward: result of ``outward_side``. On the wall itself the vector is zero.
        """
        distance, closest, _ = self._tree.point_distance(points)
        outside = self._side.outside(points) if outward > 0 else ~self._side.outside(points)
        signed = np.where(outside, -distance, distance)
        inward = np.divide(points - closest, signed[:, None], out=np.zeros_like(points), where=distance[:, None] > 0.0)
        return signed, inward


def free_distance(distance: Array, side: NDArray[np.int8], outward: int) -> Array:
    """Distances to the wall, 0 for rays that meet it from outside: their origin has left the lumen."""
    return np.where(side == -outward, 0.0, distance)


def outward_side(side: NDArray[np.int8]) -> int:
    """Return the side from which most rays meet the wall; they start inside.

    Raises:
        PathwayError: no ray meets a wall.
    """
    if not side.any():
        raise PathwayError("no wall is seen from the curve: it does not lie in this surface; give one that does")
    return 1 if int(side.sum(dtype=np.int64)) >= 0 else -1
