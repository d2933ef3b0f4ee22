"""Small meshes for the scene, made once: capsule, ball, diamond, arrow."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt
import trimesh

from vfix_engine.arrays import Array

ShapeMesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]


@functools.lru_cache(maxsize=64)
def capsule(radius: float, length: float) -> ShapeMesh:
    """Capsule whose axis runs from the origin to (0, 0, length)."""
    mesh = trimesh.creation.capsule(height=length, radius=radius, count=[24, 12])
    vertices = np.asarray(mesh.vertices)
    middle = 0.5 * (vertices[:, 2].min() + vertices[:, 2].max())
    return vertices + np.array([0.0, 0.0, length / 2.0 - middle]), np.asarray(mesh.faces)


@functools.lru_cache(maxsize=8)
def diamond(radius: float) -> ShapeMesh:
    """Octahedron: how targets differ from points, also without colour."""
    vertices = radius * np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
    )
    faces = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    return vertices, faces


def quaternion(rotation: Array) -> Array:
    """(4,) w, x, y, z of a (3, 3) rotation."""
    return np.asarray(trimesh.transformations.quaternion_from_matrix(rotation), dtype=np.float64)
