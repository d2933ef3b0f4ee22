"""Every query of the covariance tree against all triangles in turn (HAZ-08)."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_meshes import all_meshes, ball, random_tool
from geometry_oracle import every_distance

from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.pairs import Pairs, reduce_pairs
from vfix_engine.geometry.proximity import CovarianceTree, ProximityTree
from vfix_engine.geometry.spheres import enclosing_spheres

MESHES = all_meshes()
_ROUNDS = 12


def brute_force(mesh: TriangleMesh, tool: Segments) -> np.ndarray:
    """Distances (S, F) of every segment's surface to every triangle."""
    return np.array(
        [every_distance(tool.start[s], tool.end[s], mesh.triangles) - tool.radius[s] for s in range(len(tool))]
    )


def check_pairs(pairs: Pairs, distances: np.ndarray, tool: Segments, threshold: float, scale: float) -> None:
    """No pair missed, none too many, all with the right distance, points and unit normals."""
    eps = 1e-9 * scale
    found = set(zip(pairs.segment.tolist(), pairs.triangle.tolist(), strict=True))
    assert len(found) == len(pairs)
    assert found >= set(map(tuple, np.argwhere(distances <= threshold - eps).tolist()))
    assert found <= set(map(tuple, np.argwhere(distances <= threshold + eps).tolist()))
    assert pairs.distance == pytest.approx(distances[pairs.segment, pairs.triangle], abs=eps)
    assert np.linalg.norm(pairs.normal, axis=1) == pytest.approx(np.ones(len(pairs)), abs=1e-12)
    axis = pairs.distance + tool.radius[pairs.segment]
    assert pairs.on_surface + axis[:, None] * pairs.normal == pytest.approx(pairs.on_tool, abs=max(eps, 2e-9))


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("leaf_size", [0, 8])
def test_every_query_matches_brute_force(name: str, leaf_size: int) -> None:
    """HAZ-08, HAZ-09: pairs, clearance, closest pair, candidates, on friendly and degenerate meshes."""
    mesh, random = MESHES[name], np.random.default_rng(3)
    tree, scale = (
        (CovarianceTree(mesh, leaf_size) if leaf_size else ProximityTree(mesh)),
        1.0 + np.abs(mesh.vertices).max(),
    )
    for _ in range(_ROUNDS):
        tool = random_tool(random, mesh)
        distances = brute_force(mesh, tool)
        least, eps = distances.min(), 1e-9 * scale
        assert tree.clearance(tool) == pytest.approx(least, abs=eps)
        assert tree.clearance(tool, upper=least - 0.1) == least - 0.1
        nearest = tree.closest(tool)
        assert nearest.distance == pytest.approx(least, abs=eps)
        assert distances[nearest.segment, nearest.triangle] == pytest.approx(least, abs=eps)
        threshold = float(random.uniform(0.0, 4.0))
        check_pairs(tree.pairs_within(tool, threshold), distances, tool, threshold, scale)
        near = tree.candidates(tool, 4.0)
        check_pairs(near.pairs_within(tool, threshold), distances, tool, threshold, scale)
        within = distances.min(axis=1) <= 4.0 - eps
        assert near.min_distance_per_segment(tool)[within] == pytest.approx(distances.min(axis=1)[within], abs=eps)
        if least <= 4.0 - eps:
            assert near.clearance(tool) == pytest.approx(least, abs=eps)


@pytest.mark.parametrize("name", MESHES)
def test_points_match_brute_force(name: str) -> None:
    """HAZ-08: distance of points, their closest points and triangles."""
    mesh, random = MESHES[name], np.random.default_rng(4)
    low, high = mesh.bounds
    points = random.uniform(low - 3, high + 3, (25, 3))
    distance, closest, triangle = ProximityTree(mesh).point_distance(points)
    eps = 1e-9 * (1.0 + np.abs(mesh.vertices).max())
    for i, point in enumerate(points):
        every = every_distance(point, point, mesh.triangles)
        assert distance[i] == pytest.approx(every.min(), abs=eps)
        assert every[triangle[i]] == pytest.approx(every.min(), abs=eps)
        assert np.linalg.norm(point - closest[i]) == pytest.approx(every.min(), abs=eps)


@pytest.mark.parametrize("name", MESHES)
def test_valid_candidates_miss_nothing(name: str) -> None:
    """HAZ-08: a list that calls itself valid answers like the whole mesh, as it does for motions under its slack."""
    mesh, random = MESHES[name], np.random.default_rng(5)
    tree, scale = ProximityTree(mesh), 1.0 + np.abs(mesh.vertices).max()
    judged = 0
    for _ in range(_ROUNDS):
        tool = random_tool(random, mesh)
        near = tree.candidates(tool, 2.5)
        shift = random.normal(size=(2, 3, 3))
        shift *= random.uniform(0.3, 1.4) / np.linalg.norm(shift, axis=2, keepdims=True)
        moved = Segments(tool.start + shift[0], tool.end + shift[1], tool.radius)
        valid = near.valid_for(moved, 1.5)
        assert valid == bool(np.linalg.norm(shift, axis=2).max() <= 1.0 - 1e-9)
        if valid:
            judged += 1
            check_pairs(near.pairs_within(moved, 1.5), brute_force(mesh, moved), moved, 1.5, scale)
        assert not near.valid_for(Segments(tool.start, tool.end, tool.radius + 1.1), 1.5)
    assert judged > 1


def test_grouped_pairs_only_come_nearer() -> None:
    """HAZ-08: each triangle is told exactly or a grouped pair of its segment is at most as far."""
    mesh, random = ball(4), np.random.default_rng(6)
    tree, grouped = CovarianceTree(mesh, 2), 0
    for _ in range(15):
        tool = random_tool(random, mesh)
        distances = brute_force(mesh, tool)
        pairs = tree.pairs_within(tool, 3.0, group_flat=3.0, exact_within=0.5)
        told = set(zip(pairs.segment.tolist(), pairs.triangle.tolist(), strict=True))
        for s in range(len(tool)):
            mine = pairs.distance[(pairs.segment == s) & (pairs.triangle == -1)]
            grouped += len(mine)
            assert (mine > 0.5).all()
            for f in np.flatnonzero(distances[s] <= 3.0 - 1e-9):
                assert (s, int(f)) in told or (len(mine) and mine.min() <= distances[s, f] + 1e-9)
        assert np.linalg.norm(pairs.normal, axis=1) == pytest.approx(np.ones(len(pairs)))
    assert grouped > 20


def test_spheres_contain_their_triangles_and_are_small() -> None:
    """HAZ-09: every corner is inside, and no sphere is larger than the longest edge allows."""
    for mesh in MESHES.values():
        centres, radii = enclosing_spheres(mesh.triangles)
        reach = np.linalg.norm(mesh.triangles - centres[:, None], axis=2).max(axis=1)
        assert (reach <= radii + 1e-15).all()
        edges = np.linalg.norm(np.roll(mesh.triangles, -1, axis=1) - mesh.triangles, axis=2).max(axis=1)
        assert (radii <= edges / np.sqrt(3.0) * (1 + 1e-6) + 1e-9).all()


def test_leaves_hold_every_triangle_once_inside_their_boxes() -> None:
    """HAZ-08: the tree's leaves partition the mesh and each box (eq. 7) holds its triangles."""
    for mesh in MESHES.values():
        nodes = CovarianceTree(mesh, 4).nodes
        assert sorted(nodes.order.tolist()) == list(range(len(mesh.faces)))
        for n in range(len(nodes.child)):
            inside = mesh.triangles[nodes.order[nodes.first[n] : nodes.last[n]]].reshape(-1, 3)
            local = (inside - nodes.frame[n, 3]) @ nodes.frame[n, :3].T
            assert (local >= nodes.box[n, 0] - 1e-9).all()
            assert (local <= nodes.box[n, 1] + 1e-9).all()
            assert nodes.child[n] >= 0 or len(inside) <= 3 * 4


def test_reduced_pairs_are_the_nearest_of_their_kind() -> None:
    """Kept rows come nearest first and differ; each dropped one resembles a nearer kept one of its segment."""
    random = np.random.default_rng(8)
    pairs = ProximityTree(MESHES["ball"]).pairs_within(random_tool(random, MESHES["ball"]), 20.0)
    kept = reduce_pairs(pairs, max_rows=1000)
    assert (np.diff(kept.distance) >= 0).all()

    def alike(i: int, j: int) -> bool:
        return bool(
            pairs.segment[i] == kept.segment[j]
            and pairs.normal[i] @ kept.normal[j] >= 0.95
            and np.linalg.norm(pairs.on_tool[i] - kept.on_tool[j]) <= 4.0
        )

    for i in range(len(pairs)):
        assert any(alike(i, j) and kept.distance[j] <= pairs.distance[i] for j in range(len(kept)))
    assert len(reduce_pairs(pairs, max_rows=3)) == 3
    assert len(reduce_pairs(pairs.take(np.empty(0, dtype=np.int64)))) == 0
