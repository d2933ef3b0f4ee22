"""The wall of a lumen as an endoscope sees it from inside. For display only."""

from __future__ import annotations

import numpy as np

from vfix_engine.anatomy.endoscopy.air_surface import AirSurface
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh


def wall_surface(mesh: TriangleMesh) -> AirSurface:
    """The surface of a closed lumen with triangles and normals into the lumen, however its triangles are turned.

    Normals are means of those of the triangles about a vertex, weighted by their areas.
    """
    faces = mesh.faces[:, ::-1] if _volume(mesh) > 0.0 else mesh.faces
    inner = TriangleMesh(mesh.vertices, faces)
    a, b, c = (inner.vertices[inner.faces[:, corner]] for corner in range(3))
    weighted = np.cross(b - a, c - a)
    normals = np.zeros_like(inner.vertices)
    for corner in range(3):
        np.add.at(normals, inner.faces[:, corner], weighted)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return AirSurface(inner, normals / np.maximum(length, 1e-12))


def _volume(mesh: TriangleMesh) -> float:
    """Of what a surface encloses [mm³]; positive where its normals point out of it."""
    corners: Array = mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)
    return float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()) / 6.0
