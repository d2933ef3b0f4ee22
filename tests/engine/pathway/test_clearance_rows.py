"""Rows for a QP: signed clearance, how it grows, how fast it can, and which vertices are asked."""

from __future__ import annotations

import lumen_shapes
import numpy as np
import pytest

from vfix_engine.errors import InputError
from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.query.clearance import ALIKE, APART_MM, binding_vertices, clearances, lipschitz_constant
from vfix_engine.pathway.query.query import Query, deviation_of_points
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.robots.snake_surface import LinkVertices

SNAKE = SnakeModel(5)
SHAPES = {
    "cylinder": lumen_shapes.straight(),
    "arc": lumen_shapes.arc(bend=60.0, contours=16),
    "helix": lumen_shapes.helix(),
    "lobes": lumen_shapes.arc(angles=28),
    "cavity": body_cavity(),
}


def bent(pathway: Pathway, bend: float) -> np.ndarray:
    """Frames (5, 3, 4) of a snake that stands in the first contour."""
    row = pathway.packed().rows[1]
    base = np.eye(4)
    base[:3, :3] = np.column_stack([row[23:26], row[26:29], row[6:9]])
    base[:3, 3] = row[:3]
    q = np.random.default_rng(1).uniform(-bend, bend, SNAKE.dof)
    return np.ascontiguousarray(SNAKE.frames(q, base)[1:, :3])


@pytest.mark.parametrize("name", SHAPES)
def test_clearance_and_gradient(name: str) -> None:
    packed = SHAPES[name].packed()
    query, window = Query(SNAKE.vertices(400)), (0, len(packed.rows))
    frames = bent(SHAPES[name], 0.7)
    signed, gradient, segment = clearances(query, packed, frames, window)
    assert np.abs(np.maximum(signed, 0.0) - query.every_vertex(packed, frames, window)[0]).max() < 1e-11
    assert signed.min() < 0.0 < signed.max()
    # Against differences, wherever the same segment is nearest on both sides.
    step = 1e-6
    found, same = np.empty_like(gradient), np.ones(len(signed), dtype=bool)
    for axis in range(3):
        there = [frames.copy(), frames.copy()]
        there[0][:, axis, 3] += step
        there[1][:, axis, 3] -= step
        (one, _, a), (other, _, b) = (clearances(query, packed, moved, window) for moved in there)
        found[:, axis] = (one - other) / (2.0 * step)
        same &= (a == segment) & (b == segment)
    assert same.mean() > 0.9
    assert np.abs(found - gradient)[same].max() < 1e-6
    if name == "cylinder":
        assert np.abs(np.linalg.norm(gradient, axis=1) - 1.0).max() < 1e-9


def test_on_the_wall_the_gradient_points_outwards() -> None:
    points = np.array([[12.0, 0.0, -3.0], [0.0, -12.0, -9.0], [12.0 / np.sqrt(2.0), 12.0 / np.sqrt(2.0), -1.0]])
    query = Query(LinkVertices(points, np.array([0, 3])))
    frame = np.eye(4)[None]
    frame[0, 2, 3] = 100.0
    signed, gradient, _ = clearances(query, SHAPES["cylinder"].packed(), frame, (0, 32))
    assert np.abs(signed).max() < 1e-12
    assert np.abs(gradient - points * [1.0, 1.0, 0.0] / 12.0).max() < 1e-6


@pytest.mark.parametrize("name", [*SHAPES, "narrowing"])
def test_no_deviation_changes_faster_than_the_slope(name: str) -> None:
    """100,000 pairs a shape, most of them close together, over the whole of the pathway."""
    rng = np.random.default_rng(2)
    straight = SHAPES["cylinder"]
    narrowing = Pathway(straight.centre, np.linspace(20.0, 5.0, 31)[:, None], straight.count, straight.tangent)
    packed = (narrowing if name == "narrowing" else SHAPES[name]).packed()
    rows = packed.rows
    segments = len(rows)
    count = 100_000
    j = rng.integers(1, segments - 1, count)
    across = np.cross(rows[j, 6:9], rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    inscribed = rows[j, 18]
    one = rows[j, :3] + rng.uniform(0.0, 1.0, (count, 1)) * (rows[j, 3:6] - rows[j, :3])
    one += (inscribed * rng.uniform(0.8, 2.2, count))[:, None] * across
    way = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3.0, 0.5, (count, 1))
    other = one + way
    size = np.linalg.norm(way, axis=1)
    gap = [deviation_of_points(points, packed, 0, segments)[0] for points in (one, other)]
    steepest = ((np.abs(gap[1] - gap[0]) - 1e-11) / size).max()
    bound = lipschitz_constant(packed, 0, segments)
    assert 0.9 < steepest <= bound
    # The same for small deviations, with the sharper bound.
    small = np.maximum(*gap) < 0.1 * inscribed.min()
    assert small.sum() > 1000
    steepest = ((np.abs(gap[1] - gap[0]) - 1e-11) / size)[small].max()
    assert steepest <= lipschitz_constant(packed, 0, segments, 0.1 * rows[:, 18].min()) <= bound


def test_the_slope_of_a_cylinder_is_one_and_none_is_told_where_none_is_known() -> None:
    packed = SHAPES["cylinder"].packed()
    assert lipschitz_constant(packed, 0, 32) == pytest.approx(1.0, abs=1e-7)
    arc = SHAPES["arc"].packed()
    assert 1.0 < lipschitz_constant(arc, 3, 9, 1.0) < lipschitz_constant(arc, 3, 9, 11.0)
    for wrong in (-1.0, 12.0, np.nan):
        with pytest.raises(InputError, match="least inscribed radius"):
            lipschitz_constant(arc, 3, 9, wrong)


def test_of_each_link_those_are_chosen_that_stand_out() -> None:
    packed = SHAPES["arc"].packed()
    query, window = Query(SNAKE.vertices(500)), (0, len(packed.rows))
    frames, bound = bent(SHAPES["arc"], 0.4), np.array([2.0, 3.0, 4.0, 5.0, 6.0])
    signed, gradient, _ = clearances(query, packed, frames, window)
    found = binding_vertices(query, packed, frames, window, bound, per_link=6)
    assert np.bincount(found.link, minlength=5).tolist() == [6] * 5
    start, points = query.vertices.start, query.vertices.points
    for link in range(5):
        own = found.vertex[found.link == link]
        assert ((start[link] <= own) & (own < start[link + 1])).all()
        assert own[0] == start[link] + signed[start[link] : start[link + 1]].argmax()
        assert (np.diff(signed[own]) <= 0.0).all()
        for a in range(6):
            for b in range(a):
                apart = np.linalg.norm(points[own[a]] - points[own[b]]) >= APART_MM
                one, other = gradient[own[a]], gradient[own[b]]
                assert apart or one @ other <= ALIKE * np.linalg.norm(one) * np.linalg.norm(other) + 1e-12
        placed = points[own] @ frames[link, :, :3].T + frames[link, :, 3]
        assert np.abs(placed - found.point[found.link == link]).max() < 1e-12
    assert np.array_equal(found.signed, signed[found.vertex])
    assert np.array_equal(found.gradient, gradient[found.vertex])
    near = binding_vertices(query, packed, frames, window, bound, near_mm=1.0)
    assert (near.signed >= bound[near.link] - 1.0).all()
    nowhere = binding_vertices(query, packed, frames, window, np.full(5, 1e3), near_mm=1.0)
    assert nowhere.vertex.size == 0
    for wrong in (np.ones(3), np.full(5, np.nan)):
        with pytest.raises(InputError, match="bounds"):
            binding_vertices(query, packed, frames, window, wrong)
