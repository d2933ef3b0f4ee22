"""Deviation of links: the fast query against every vertex and every segment (Kwok 2013, eq. 8-9)."""

from __future__ import annotations

import lumen_shapes
import numpy as np
import pytest

from vfix_engine.errors import InputError, PathwayError
from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.query import query_blocks
from vfix_engine.pathway.query.query import Deviations, Query, deviation_of_points
from vfix_engine.pathway.query.query_blocks import CHILD, RADIUS, vertex_blocks
from vfix_engine.pathway.query.query_fast import largest_excess, link_deviations
from vfix_engine.pathway.query.query_simd import WORK
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.robots.snake_surface import LinkVertices

SNAKE = SnakeModel(5)
NEAR = 2e-10  # [mm] eq. 5 lets points be inside that are 1e-10 mm beyond an edge; all else is rounding
TAPERED = np.linspace(18.0, 6.0, 31)[:, None]
STRAIGHT = lumen_shapes.straight()
SHAPES = {
    "cylinder": STRAIGHT,
    "cone": Pathway(STRAIGHT.centre, TAPERED, STRAIGHT.count, STRAIGHT.tangent),
    "arc": lumen_shapes.arc(bend=60.0, contours=16),
    "helix": lumen_shapes.helix(),
    "lobes": lumen_shapes.arc(angles=28),
    "cavity": body_cavity(),
}


def pose(rng: np.random.Generator, packed: PackedPathway, spread: float) -> np.ndarray:
    """Frames (5, 3, 4) of a snake that starts near the middle of some segment, along it or, with a spread, not."""
    row = packed.rows[rng.integers(1, max(len(packed.rows) // 2, 2))]
    base = np.eye(4)
    base[:3, 2] = row[6:9]
    base[:3, 0] = row[23:26]
    base[:3, 1] = np.cross(base[:3, 2], base[:3, 0])
    base[:3, 3] = row[:3] + rng.normal(size=3) * 20.0 * spread
    found: np.ndarray = SNAKE.frames(rng.uniform(-spread, spread, SNAKE.dof), base)[1:, :3]
    return np.ascontiguousarray(found)


def placed(vertices: LinkVertices, frames: np.ndarray, link: int) -> np.ndarray:
    own = vertices.points[vertices.start[link] : vertices.start[link + 1]]
    found: np.ndarray = own @ frames[link, :, :3].T + frames[link, :, 3]
    return found


def held_against_all(query: Query, packed: PackedPathway, frames: np.ndarray, window: tuple[int, int]) -> np.ndarray:
    """Depths (5,), after both faces were compared with every vertex against every segment."""
    found = query.deviations(packed, frames, window)
    gaps, segments = query.every_vertex(packed, frames, window)
    start = query.vertices.start
    for link in range(query.links):
        points = placed(query.vertices, frames, link)
        wanted = deviation_of_points(points, packed, *window)[0]
        assert abs(found.depth[link] - wanted.max()) < NEAR
        own = slice(start[link], start[link + 1])
        assert np.abs(gaps[own] - wanted).max() < NEAR
        # Who is named is to blame.
        vertex, segment = found.vertex[link] - start[link], found.segment[link]
        assert window[0] <= segment < window[1]
        alone = deviation_of_points(points[[vertex]], packed, segment, segment + 1)[0]
        assert abs(alone[0] - found.depth[link]) < NEAR
        if found.depth[link] == 0.0:
            assert vertex == 0
        for k in range(0, len(points), 7):
            at = segments[own][k]
            assert abs(deviation_of_points(points[[k]], packed, at, at + 1)[0][0] - wanted[k]) < NEAR
    return found.depth


@pytest.mark.parametrize("name", SHAPES)
def test_it_is_what_every_vertex_against_every_segment_gives(name: str) -> None:
    rng = np.random.default_rng(1)
    packed = SHAPES[name].packed()
    segments = len(packed.rows)
    query = Query(SNAKE.vertices(500))
    depths = []
    for k in range(36):
        first = int(rng.integers(0, segments))
        window = (0, segments) if k % 3 else (first, int(rng.integers(first + 1, segments + 1)))
        depths.append(held_against_all(query, packed, pose(rng, packed, (0.01, 0.1, 0.4, 1.2)[k % 4]), window))
    assert np.min(depths) == 0.0
    assert 5.0 < np.max(depths) < np.inf


def test_leaning_contours_and_jagged_radii() -> None:
    """Whatever a pathway's checks let pass; the robot's base stands in a contour, its x axis along the angle 0."""
    rng = np.random.default_rng(7)
    query = Query(SNAKE.vertices(300))
    asked = 0
    while asked < 40:
        contours, angles = int(rng.integers(3, 10)), int(rng.choice([1, 3, 28]))
        bend = np.cumsum(rng.normal(size=(contours, 2)) * rng.choice([0.02, 0.2, 0.5]), axis=0)
        way = np.column_stack([np.sin(bend), np.ones(contours)])
        way /= np.linalg.norm(way, axis=1)[:, None]
        centre = np.cumsum(way * rng.uniform(5.0, 50.0, (contours, 1)), axis=0)
        tangent = way + rng.normal(size=(contours, 3)) * rng.choice([0.0, 0.1, 0.4])
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        radius = rng.uniform(4.0, 20.0) * np.exp(rng.normal(size=(contours, angles)) * rng.choice([0.02, 0.3]))
        try:
            packed = Pathway(centre, radius, contours, tangent).packed()
        except PathwayError:
            continue
        for spread in (0.0, 0.2):
            held_against_all(query, packed, pose(rng, packed, spread), (0, len(packed.rows)))
        asked += 1


@pytest.mark.parametrize("count", [5, 13, 90, 3000, 14_800])
def test_any_number_of_vertices(count: int) -> None:
    """From one a link to three levels of the tree."""
    rng = np.random.default_rng(count)
    packed = SHAPES["arc"].packed()
    query = Query(SNAKE.vertices(count))
    for spread in (0.0, 0.15):
        held_against_all(query, packed, pose(rng, packed, spread), (0, len(packed.rows)))


def test_all_inside_is_zero_at_the_first_vertex() -> None:
    packed = lumen_shapes.straight(radius=20.0).packed()
    q, base = np.zeros(SNAKE.dof), np.eye(4)
    base[2, 3] = 30.0
    query = Query(SNAKE.vertices(500))
    found = query.deviations(packed, SNAKE.frames(q, base), (1, 31))
    assert (found.depth == 0.0).all()
    assert np.array_equal(found.vertex, query.vertices.start[:-1])
    assert found.segment[0] < found.segment[-1]


def test_a_robot_far_away_is_far_away() -> None:
    rng = np.random.default_rng(3)
    packed = SHAPES["helix"].packed()
    query = Query(SNAKE.vertices(300))
    for size in (1e3, 1e5):
        frames = pose(rng, packed, 0.3)
        frames[:, :, 3] += size * rng.normal(size=3)
        found = query.deviations(packed, frames, (3, 30))
        for link in range(5):
            wanted = deviation_of_points(placed(query.vertices, frames, link), packed, 3, 30)[0].max()
            assert abs(found.depth[link] - wanted) < 1e-14 * size + 1e-11


def test_several_poses_and_a_window_for_each_link() -> None:
    rng = np.random.default_rng(4)
    packed = SHAPES["arc"].packed()
    query = Query(SNAKE.vertices(200))
    poses = np.array([pose(rng, packed, 0.2) for _ in range(7)])
    windows = np.array([[0, 4], [1, 9], [2, 3], [0, 17], [5, 17]])
    together = query.deviations(packed, poses, windows)
    assert together.depth.shape == together.vertex.shape == together.segment.shape == (7, 5)
    for k in range(7):
        alone = query.deviations(packed, poses[k], windows)
        assert all(np.array_equal(one[k], other) for one, other in zip(together, alone, strict=True))
        for link, (first, last) in enumerate(windows):
            wanted = deviation_of_points(placed(query.vertices, poses[k], link), packed, first, last)[0].max()
            assert abs(alone.depth[link] - wanted) < 1e-11


def test_bounds_are_judged_as_the_depths_are() -> None:
    rng = np.random.default_rng(5)
    judged = []
    for name in ("helix", "arc", "lobes"):
        packed = SHAPES[name].packed()
        blocks, work = vertex_blocks(SNAKE.vertices(500)), np.zeros(WORK)
        query = Query(SNAKE.vertices(500))
        window = np.tile([0, len(packed.rows)], (5, 1))
        for _ in range(30):
            frames = pose(rng, packed, 0.2)
            depth = query.deviations(packed, frames, window).depth
            bound = depth + rng.choice([1e-9, 1.0, 30.0], 5)
            bound[rng.integers(5)] -= rng.choice([0.0, 2e-9, 1.0])
            excess = largest_excess(packed, blocks, window, frames, bound, False, work)
            assert excess == pytest.approx((depth - bound).max(), abs=1e-12)
            judged.append(largest_excess(packed, blocks, window, frames, bound, True, work) <= 0.0)
            assert judged[-1] == (depth <= bound).all() == (excess <= 0.0)
        bound[2] = np.nan
        assert largest_excess(packed, blocks, window, frames, bound, False, work) == np.inf
    assert 10 < sum(judged) < 80


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e200])
def test_a_place_that_is_no_number_deviates_infinitely(wrong: float) -> None:
    packed = SHAPES["cylinder"].packed()
    base = np.eye(4)
    base[2, 3] = 30.0
    blocks, work = vertex_blocks(SNAKE.vertices(500)), np.zeros(WORK)
    window = np.tile([0, 32], (5, 1))
    depth, vertex, segment = np.empty(5), np.empty(5, dtype=np.int64), np.empty(5, dtype=np.int64)
    for row, column in ((0, 3), (1, 1), (2, 0)):
        frames = np.ascontiguousarray(SNAKE.frames(np.zeros(10), base)[1:, :3])
        frames[3, row, column] = wrong
        link_deviations(packed, blocks, window, frames, Deviations(depth, vertex, segment), work)
        assert depth.tolist() == [0.0, 0.0, 0.0, np.inf, 0.0]
        assert largest_excess(packed, blocks, window, frames, np.full(5, 1e9), True, work) == np.inf
        query = Query(SNAKE.vertices(500))
        for ask in (query.deviations, query.every_vertex):
            with pytest.raises(InputError, match="not finite"):
                ask(packed, frames, (0, 32))


def test_the_tree_holds_every_vertex_once() -> None:
    for count in (5, 81, 1700, 30_003):
        vertices = SNAKE.vertices(count)
        blocks = vertex_blocks(vertices)
        for link in range(5):
            own = range(vertices.start[link], vertices.start[link + 1])
            first, last = blocks.start[link : link + 2]
            assert np.array_equal(np.unique(blocks.index[first:last]), own)
            assert blocks.index[first, 0] == own[0]
            reached = walk(blocks.ball, link, blocks.lanes, vertices.points, blocks.index)
            assert np.array_equal(np.sort(reached), np.arange(first, last))
        points = vertices.points[blocks.index].transpose(0, 2, 1).reshape(-1, 48)
        assert np.array_equal(blocks.lanes[:, :48], points)


def walk(nodes: np.ndarray, node: int, lanes: np.ndarray, points: np.ndarray, index: np.ndarray) -> list[int]:
    """Blocks below a node; every ball holds all that is below it."""
    found: list[int] = []
    for lane in range(16):
        if nodes[node, RADIUS + lane] < 0.0:
            continue
        child = int(nodes[node, CHILD + lane])
        below = walk(nodes, child, lanes, points, index) if child >= 0 else [-1 - child]
        away = points[index[below]].reshape(-1, 3) - nodes[node, [lane, 16 + lane, 32 + lane]]
        assert np.linalg.norm(away, axis=1).max() <= nodes[node, RADIUS + lane]
        found += below
    return found


def test_what_cannot_be_asked_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    packed = SHAPES["cylinder"].packed()
    query = Query(SNAKE.vertices(100))
    frames = SNAKE.frames(np.zeros(10), np.eye(4))
    assert np.array_equal(*(query.deviations(packed, one, (0, 9)).depth for one in (frames, frames[1:, :3])))
    for windows in ((0, 0), (3, 2), (-1, 4), (0, 33)):
        with pytest.raises(InputError, match="0 ≤ first < last ≤ 32"):
            query.deviations(packed, frames, windows)
    for windows in ((0.0, 3.0), [[0, 1]], (1, 2, 3)):
        with pytest.raises(InputError, match="one pair"):
            query.deviations(packed, frames, windows)
    for wrong in (frames[:3], np.zeros((5, 4)), np.zeros((5, 2, 4))):
        with pytest.raises(InputError, match="frames"):
            query.every_vertex(packed, wrong, (0, 9))
    with pytest.raises(InputError, match="points"):
        deviation_of_points([[0.0, np.nan, 0.0]], packed, 0, 9)
    with pytest.raises(InputError, match="link 1 has no vertices"):
        Query(LinkVertices(np.zeros((3, 3)), np.array([0, 3, 3])))
    with monkeypatch.context() as few:
        few.setattr(query_blocks, "MOST", 19)
        with pytest.raises(InputError, match="link 0 has 20 vertices"):
            vertex_blocks(SNAKE.vertices(100))
    with pytest.raises(InputError, match="finite"):
        Query(LinkVertices(np.full((3, 3), np.inf), np.array([0, 3])))
