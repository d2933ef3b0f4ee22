"""Every query of both structures against all triangles in turn (HAZ-08)."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_meshes import all_meshes, ball, random_tool
from geometry_oracle import every_distance

from vfix_engine.errors import InputError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.covariance.spheres import enclosing_spheres
from vfix_engine.proximity.pairs import Pairs, reduce_pairs
from vfix_engine.proximity.proximity import CovarianceTree, Proximity, ProximityTree

MESHES = all_meshes()
STRUCTURES = {
    "wide": ProximityTree,
    "covariance": CovarianceTree,
    "covariance, one to a leaf": lambda mesh: CovarianceTree(mesh, 1),
}
_ROUNDS = 12
_MANY = 1800  # tools for each mesh and structure; with every kind of query more than 10⁵ in all


def brute_force(mesh: TriangleMesh, tool: Segments) -> np.ndarray:
    """Distances (S, F) of every segment's surface to every triangle."""
    return every_distance(tool.start, tool.end, mesh.triangles) - tool.radius[:, None]


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
@pytest.mark.parametrize("structure", STRUCTURES)
def test_every_query_matches_brute_force(name: str, structure: str) -> None:
    """HAZ-08, HAZ-09: pairs, clearance, closest pair, candidates, on friendly and degenerate meshes."""
    mesh, random = MESHES[name], np.random.default_rng(3)
    tree: Proximity = STRUCTURES[structure](mesh)
    scale = 1.0 + np.abs(mesh.vertices).max()
    assert tree.mesh is mesh
    for _ in range(_ROUNDS):
        tool = random_tool(random, mesh)
        distances = brute_force(mesh, tool)
        least, eps = distances.min(), 1e-9 * scale
        assert tree.clearance(tool) == pytest.approx(least, abs=eps)
        assert tree.clearance(tool, upper=least - 0.1) == least - 0.1
        nearest = tree.closest(tool)
        assert nearest.distance == pytest.approx(least, abs=eps)
        assert distances[nearest.segment, nearest.triangle] == pytest.approx(least, abs=eps)
        away = nearest.distance + tool.radius[nearest.segment]
        assert nearest.on_surface + away * nearest.normal == pytest.approx(nearest.on_tool, abs=max(eps, 2e-9))
        threshold = float(random.uniform(0.0, 4.0))
        check_pairs(tree.pairs_within(tool, threshold), distances, tool, threshold, scale)
        near = tree.candidates(tool, 4.0)
        check_pairs(near.pairs_within(tool, threshold), distances, tool, threshold, scale)
        assert len(near) >= (distances <= 4.0 - eps).sum()
        within = distances.min(axis=1) <= 4.0 - eps
        assert near.min_distance_per_segment(tool)[within] == pytest.approx(distances.min(axis=1)[within], abs=eps)
        if least <= 4.0 - eps:
            assert near.clearance(tool) == pytest.approx(least, abs=eps)


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("structure", ["wide", "covariance"])
def test_many_queries_match_brute_force(name: str, structure: str) -> None:
    """HAZ-08: 10⁵ queries in all; closest pair, clearance, pairs, and the same of a candidate list."""
    mesh, random = MESHES[name], np.random.default_rng(9)
    tree: Proximity = STRUCTURES[structure](mesh)
    eps = 1e-9 * (1.0 + np.abs(mesh.vertices).max())
    for _ in range(_MANY):
        tool = random_tool(random, mesh)
        distances = brute_force(mesh, tool)
        least, threshold = float(distances.min()), float(random.uniform(0.0, 3.0))
        assert abs(tree.clearance(tool) - least) <= eps
        assert abs(tree.closest(tool).distance - least) <= eps
        near = tree.candidates(tool, 3.0)
        if least <= 3.0 - eps:
            assert abs(near.clearance(tool) - least) <= eps
        for pairs in (tree.pairs_within(tool, threshold), near.pairs_within(tool, threshold)):
            told = np.full(distances.shape, np.inf)
            told[pairs.segment, pairs.triangle] = pairs.distance
            assert (np.isfinite(told) | (distances > threshold - eps)).all()
            assert np.abs(pairs.distance - distances[pairs.segment, pairs.triangle]).max(initial=0.0) <= eps
            assert pairs.distance.max(initial=-np.inf) <= threshold + eps


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("structure", ["wide", "covariance"])
def test_points_match_brute_force(name: str, structure: str) -> None:
    """HAZ-08: distance of points, their closest points and triangles, however far away they are."""
    mesh, random = MESHES[name], np.random.default_rng(4)
    low, high = mesh.bounds
    points = random.uniform(low - 3, high + 3, (400, 3))
    points[:3] += [[1e3, 0, 0], [0, -1e7, 0], [1e14, 1e16, 0]]
    points[3:6] = mesh.vertices[mesh.faces[0]]
    distance, closest, triangle = STRUCTURES[structure](mesh).point_distance(points)
    every = every_distance(points, points, mesh.triangles)
    eps = 1e-9 * (1.0 + np.maximum(np.abs(points).max(axis=1), np.abs(mesh.vertices).max()))
    assert (np.abs(distance - every.min(axis=1)) <= eps).all()
    assert (np.abs(every[np.arange(len(points)), triangle] - every.min(axis=1)) <= eps).all()
    assert (np.abs(np.linalg.norm(points - closest, axis=1) - distance) <= eps).all()


@pytest.mark.parametrize("where", [1e4, 1e8, 1e17])
def test_far_tools_are_measured_as_well(where: float) -> None:
    """HAZ-08: single precision sorts out and never decides, also where its numbers end."""
    mesh = MESHES["ball"]
    tool = Segments([[where, 0, 0]], [[where, 10, 3]], [1.0])
    least = brute_force(mesh, tool).min()
    for structure in STRUCTURES.values():
        assert structure(mesh).clearance(tool) == pytest.approx(least, rel=1e-12)
        assert len(structure(mesh).pairs_within(tool, 3.0)) == 0
        assert len(structure(mesh).candidates(tool, 3.0).pairs_within(tool, 3.0)) == 0


@pytest.mark.parametrize("name", MESHES)
def test_a_moved_mesh_is_searched_as_a_new_one(name: str) -> None:
    """HAZ-08: the tree that keeps its order answers exactly, also when neighbours have been torn apart."""
    mesh, random = MESHES[name], np.random.default_rng(10)
    tree = ProximityTree(mesh)
    for size in (0.1, 20.0):
        shifted = TriangleMesh(mesh.vertices + random.normal(scale=size, size=mesh.vertices.shape), mesh.faces)
        moved, scale = tree.moved(shifted), 1.0 + np.abs(shifted.vertices).max()
        for _ in range(5):
            tool = random_tool(random, shifted)
            distances = brute_force(shifted, tool)
            assert moved.clearance(tool) == pytest.approx(distances.min(), abs=1e-9 * scale)
            check_pairs(moved.pairs_within(tool, 3.0), distances, tool, 3.0, scale)
    with pytest.raises(InputError, match="faces"):
        tree.moved(TriangleMesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces])))


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("structure", ["wide", "covariance"])
def test_valid_candidates_miss_nothing(name: str, structure: str) -> None:
    """HAZ-08: a list that calls itself valid answers like the whole mesh, as it does for motions under its slack."""
    mesh, random = MESHES[name], np.random.default_rng(5)
    tree: Proximity = STRUCTURES[structure](mesh)
    scale, judged = 1.0 + np.abs(mesh.vertices).max(), 0
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


@pytest.mark.parametrize("name", ["ball", "soup", "far"])
def test_grouped_pairs_only_come_nearer(name: str) -> None:
    """HAZ-08: each triangle is told exactly or a grouped pair of its segment is at most as far and not too near."""
    mesh = ball(4) if name == "ball" else MESHES[name]
    random, grouped = np.random.default_rng(6), 0
    tree = CovarianceTree(mesh, 2)
    eps = 1e-9 * (1.0 + np.abs(mesh.vertices).max())
    for _ in range(40):
        tool = random_tool(random, mesh)
        distances = brute_force(mesh, tool)
        pairs = tree.pairs_within(tool, 3.0, group_flat=3.0, exact_within=0.5)
        told = set(zip(pairs.segment.tolist(), pairs.triangle.tolist(), strict=True))
        for s in range(len(tool)):
            group = (pairs.segment == s) & (pairs.triangle == -1)
            grouped += int(group.sum())
            assert (pairs.distance[group] > 0.5 - eps).all()
            for f in np.flatnonzero(distances[s] <= 3.0 - eps):
                if (s, int(f)) not in told:
                    assert distances[s, f] > 0.5
                    assert pairs.distance[group].min(initial=np.inf) <= distances[s, f] + eps
        assert np.linalg.norm(pairs.normal, axis=1) == pytest.approx(np.ones(len(pairs)))
        axis = pairs.distance + tool.radius[pairs.segment]
        assert pairs.on_surface + axis[:, None] * pairs.normal == pytest.approx(pairs.on_tool, abs=max(eps, 2e-9))
        exact = pairs.triangle >= 0
        assert pairs.distance[exact] == pytest.approx(distances[pairs.segment[exact], pairs.triangle[exact]], abs=eps)
    assert grouped > 20 or name != "ball"


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


def rounded(facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (B, 16, 3, 3) of the rounded triangles, and how far they are off at most, as each block says itself."""
    blocks = facets.reshape(-1, 56)
    head = np.ascontiguousarray(blocks[:, :8]).view(np.float32).astype(float)
    words = blocks[:, 8:].reshape(-1, 3, 16).astype(np.int64) & 0xFFFFFFFF
    steps = 1.0 + np.stack([words >> 12 & 1023, words >> 2 & 1023, words >> 22], axis=-1) / 1024.0
    middle = head[:, None, :3] + head[:, 3, None, None] * steps[:, 0]
    one, two = (head[:, 4, None, None] * (steps[:, i] - 1.5) for i in (1, 2))
    return np.stack([middle + one, middle + two, middle - one - two], axis=2), head[:, 5]


def test_a_wide_tree_holds_every_triangle_once() -> None:
    """HAZ-08: each face has one lane, each box holds its triangles, each facet is its triangle."""
    for mesh in MESHES.values():
        wide = ProximityTree(mesh).arrays
        assert sorted(wide.label[wide.label >= 0].tolist()) == list(range(len(mesh.faces)))
        blocks = int(wide.level[1])
        corners = wide.corners.reshape(blocks, 3, 3, 16).transpose(0, 3, 1, 2)
        real = wide.label.reshape(blocks, 16)
        assert (corners[real >= 0] == mesh.triangles[real[real >= 0]]).all()
        local = corners - wide.frame[:3]
        told, off = rounded(wide.facets)
        assert (np.linalg.norm(told - local, axis=-1) <= off[:, None, None] + 1e-9).all()
        assert (off <= 0.003 * np.ptp(local, axis=(1, 2)).max(axis=-1) + 1e-6 * wide.frame[3]).all()
        node, lane = np.divmod(np.arange(blocks), 16)
        box = wide.boxes.reshape(-1, 6, 16).astype(float)[node, :, lane]
        assert (np.abs(local - box[:, None, None, :3]) <= box[:, None, None, 3:]).all()


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
