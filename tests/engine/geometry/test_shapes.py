"""Mesh, capsules and the search for a place that fits."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_meshes import ball

from vfix_engine.errors import InputError, MeshError, PlanError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.fit import nearest_free_point
from vfix_engine.proximity.proximity import ProximityTree

CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        ([[0, 0, 0], [np.nan, 0, 0], [0, 1, 0]], [[0, 1, 2]], "not finite, the first is number 1"),
        (CORNERS, [[0, 1, 3]], "from 0 to 3"),
        (CORNERS, [[0, 1, -1]], "from -1"),
        (CORNERS, np.empty((0, 3), int), "no triangle"),
        (CORNERS, [[0, 1, 2, 0]], "only triangles"),
        (CORNERS, [[0.5, 1, 2]], "integers"),
        ([[0, 0]], [[0, 0, 0]], "expected \\(V, 3\\)"),
    ],
)
def test_bad_meshes_are_refused(vertices: object, faces: object, words: str) -> None:
    """HAZ-09: each with its reason."""
    with pytest.raises(MeshError, match=words):
        TriangleMesh(vertices, faces)


def test_a_mesh_is_its_own_and_read_only() -> None:
    """The arrays are copies that nobody can change, and the hash follows the content."""
    source = np.array(CORNERS)
    mesh = TriangleMesh(source, [[0, 1, 2], [0, 0, 1]])
    source[0] = 9.0
    assert mesh.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]
    assert mesh.face_normals.tolist() == [[0, 0, 1], [0, 0, 0]]
    for array in (mesh.vertices, mesh.faces, mesh.triangles, mesh.bounds, mesh.face_normals):
        assert not array.flags.writeable
    assert mesh.content_hash == TriangleMesh(CORNERS, [[0, 1, 2], [0, 0, 1]]).content_hash
    assert mesh.content_hash != TriangleMesh(CORNERS, [[0, 1, 2], [0, 1, 0]]).content_hash


def test_bad_segments_are_refused() -> None:
    """HAZ-05: nothing that is not finite becomes a pose of the tool."""
    zero = np.zeros((1, 3))
    with pytest.raises(InputError, match="not finite"):
        Segments(zero, zero + np.inf, [1.0])
    with pytest.raises(InputError, match="negative"):
        Segments(zero, zero, [-1.0])
    with pytest.raises(InputError, match="segments need"):
        Segments(zero, np.zeros((2, 3)), [1.0])


def test_the_nearest_place_of_a_ball() -> None:
    """From inside a ball that counts as bone, straight out through its wall; a place that fits stays."""
    tree = ProximityTree(ball(4))

    def inside(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points, axis=1) < 10.0

    place = nearest_free_point(tree, [0.0, 0.0, 8.0], 1.5, inside_bone=inside)
    assert np.linalg.norm(place) >= 11.4
    assert np.linalg.norm(place - [0, 0, 8]) == pytest.approx(3.5, abs=0.3)
    assert nearest_free_point(tree, [0.0, 0.0, 0.0], 1.5, inside_bone=None).tolist() == [0, 0, 0]
    with pytest.raises(PlanError, match="no point within"):
        nearest_free_point(tree, [0.0, 0.0, 0.0], 1.5, inside_bone=inside, max_move=5.0)
    with pytest.raises(PlanError, match="finite"):
        nearest_free_point(tree, [np.nan, 0.0, 0.0], 1.5, inside_bone=None)
