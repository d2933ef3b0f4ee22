"""The tree on the real bone of nose and sinuses, measured again by coal."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pytest
import trimesh
from geometry_meshes import bent_tools

from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.fit import nearest_free_point
from vfix_engine.proximity.proximity import ProximityTree


@pytest.fixture(scope="module")
def tree(trial_data: Path) -> ProximityTree:
    made = trimesh.load(trial_data / "head_ct" / "nose_sinus_bone_lps_mm.ply", process=False)
    return ProximityTree(TriangleMesh(made.vertices, made.faces))


@pytest.fixture(scope="module")
def coal_mesh(tree: ProximityTree) -> coal.BVHModelOBBRSS:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(tree.mesh.faces), len(tree.mesh.vertices))
    model.addVertices(tree.mesh.vertices)
    model.addTriangles(tree.mesh.faces.astype(np.int64))
    model.endModel()
    return model


def coal_distance(model: coal.BVHModelOBBRSS, tool: Segments, s: int) -> float:
    """Distance of one capsule to the mesh."""
    along = tool.end[s] - tool.start[s]
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    pose = coal.Transform3s(np.column_stack([x, np.cross(z, x), z]), 0.5 * (tool.start[s] + tool.end[s]))
    result = coal.DistanceResult()
    capsule = coal.Capsule(float(tool.radius[s]), length)
    return float(coal.distance(capsule, pose, model, coal.Transform3s(), coal.DistanceRequest(), result))


def test_clearance_agrees_with_coal(tree: ProximityTree, coal_mesh: coal.BVHModelOBBRSS) -> None:
    """HAZ-01, HAZ-08: free tools have coal's clearance to 1e-6 mm; where coal sees contact so do we."""
    free = 0
    for tool in bent_tools(np.random.default_rng(11), tree.mesh, 150):
        ours = tree.clearance(tool)
        coals = min(coal_distance(coal_mesh, tool, s) for s in range(len(tool)))
        if ours > 1e-6:
            free += 1
            assert coals == pytest.approx(ours, abs=1e-6)
        else:
            assert coals <= 1e-6
    assert free > 30


def test_candidates_and_pairs_agree_with_the_tree(tree: ProximityTree) -> None:
    """HAZ-08: lists, pairs and clearance tell one story on 182,000 triangles."""
    for tool in bent_tools(np.random.default_rng(12), tree.mesh, 60):
        pairs, near = tree.pairs_within(tool, 3.0), tree.candidates(tool, 3.75)
        again = near.pairs_within(tool, 3.0)
        assert set(zip(pairs.segment, pairs.triangle, strict=True)) == set(
            zip(again.segment, again.triangle, strict=True)
        )
        least = tree.clearance(tool)
        assert near.clearance(tool) == pytest.approx(least, abs=1e-12) or least > 3.75
        if len(pairs):
            assert pairs.distance.min() == pytest.approx(least, abs=1e-12)


def test_a_point_in_bone_moves_to_where_the_tool_fits(tree: ProximityTree) -> None:
    """HAZ-04: the place has the asked room and no nearer place of a dense sample has it."""
    point = tree.mesh.vertices[1000]
    place = nearest_free_point(tree, point, 1.8, inside_bone=None)
    assert tree.point_distance(place[None])[0][0] >= 1.8
    random = np.random.default_rng(13)
    moved = float(np.linalg.norm(place - point))
    directions = random.normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    nearer = point + directions * (max(moved - 0.6, 0.0) * random.uniform(0, 1, (20000, 1)) ** (1 / 3))
    assert (tree.point_distance(nearer)[0] < 1.8).all()
