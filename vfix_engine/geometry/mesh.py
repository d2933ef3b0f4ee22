"""Triangle mesh of an anatomical surface."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import MeshError
from .checks import out_of_range


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Surface in the patient frame (LPS, mm); the normals point out of bone.

    Args:
        vertices: (V, 3) mm.
        faces: (F, 3) indices into the vertices.

    Raises:
        MeshError: wrong shapes, no triangle, a vertex that is not finite or a kilometre away, or an index out of range
            (HAZ-09).
    """

    vertices: Array
    faces: NDArray[np.int32]

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points = np.array(vertices, dtype=np.float64, order="C")
        corners = np.asarray(faces)
        if points.ndim != 2 or points.shape[1] != 3:
            raise MeshError(f"vertices have the shape {points.shape}, expected (V, 3)")
        if corners.ndim != 2 or corners.shape[1] != 3:
            raise MeshError(f"faces have the shape {corners.shape}, expected (F, 3); only triangles are accepted")
        if not len(corners):
            raise MeshError("the surface has no triangle")
        if corners.dtype.kind not in "iu":
            raise MeshError(f"face indices must be integers, not {corners.dtype}")
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if len(bad):
            raise MeshError(f"{len(bad)} of {len(points)} vertices are not finite, the first is number {bad[0]}")
        if far := out_of_range(points):
            raise MeshError(f"vertex number {far[0]} of the surface {far[1]}")
        if corners.min() < 0 or corners.max() >= len(points):
            raise MeshError(
                f"face indices run from {corners.min()} to {corners.max()}, but there are {len(points)} vertices"
            )
        indices = np.array(corners, dtype=np.int32, order="C")
        points.setflags(write=False)
        indices.setflags(write=False)
        object.__setattr__(self, "vertices", points)
        object.__setattr__(self, "faces", indices)

    @cached_property
    def triangles(self) -> Array:
        """Corners (F, 3, 3) in mm."""
        corners: Array = self.vertices[self.faces]
        corners.setflags(write=False)
        return corners

    @cached_property
    def bounds(self) -> Array:
        """Lowest and highest corner (2, 3) of the axis-aligned bounding box of the triangles, in mm."""
        used = self.vertices[np.unique(self.faces)]
        box: Array = np.array([used.min(axis=0), used.max(axis=0)])
        box.setflags(write=False)
        return box

    @cached_property
    def face_normals(self) -> Array:
        """Unit normals (F, 3), right-handed about the corners; zero for a triangle without area."""
        a, b, c = np.moveaxis(self.triangles, 1, 0)
        normals: Array = np.cross(b - a, c - a)
        size = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.divide(normals, size, out=np.zeros_like(normals), where=size > 0.0)
        normals.setflags(write=False)
        return normals

    @cached_property
    def volume_mm3(self) -> float:
        """Volume [mm³] enclosed by a closed surface, negative if its normals point inwards."""
        a, b, c = np.moveaxis(self.triangles - self.bounds.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0

    @cached_property
    def content_hash(self) -> str:
        """SHA-256 (hex) of vertices and faces: equal only for equal meshes."""
        digest = hashlib.sha256(f"{self.vertices.shape} {self.faces.shape}".encode())
        digest.update(self.vertices.astype("<f8").tobytes())
        digest.update(self.faces.astype("<i4").tobytes())
        return digest.hexdigest()
