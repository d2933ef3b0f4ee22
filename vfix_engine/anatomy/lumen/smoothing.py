"""Smoothing of a wall that is made of voxels, whose steps a picture of it would show as edges."""

from __future__ import annotations

import numpy as np

from ...geometry.mesh import TriangleMesh

_IN, _OUT = 0.5, -0.53  # Taubin's factors: a step inwards, and one outwards that undoes the shrinking
ROUNDS = 10


def smoothed(mesh: TriangleMesh, rounds: int = ROUNDS) -> TriangleMesh:
    """The surface with each vertex moved towards the mean of its neighbours and back, without shrinking.

    G. Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995.
    """
    from scipy.sparse import coo_array, diags_array  # imported here: slow to load

    faces = np.asarray(mesh.faces, dtype=np.int64)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = len(mesh.vertices)
    both = np.unique(np.concatenate([edges @ [count, 1], edges @ [1, count]]))  # each neighbour once, both ways
    near = coo_array((np.ones(len(both)), (both // count, both % count)), shape=(count, count)).tocsr()
    mean = diags_array(1.0 / np.maximum(near.sum(axis=1), 1.0)) @ near
    places = np.array(mesh.vertices)
    for _ in range(rounds):
        for factor in (_IN, _OUT):
            places += factor * (mean @ places - places)
    return TriangleMesh(places, mesh.faces)
