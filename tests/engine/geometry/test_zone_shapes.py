"""Shapes that the tool keeps out of: exact signed distances, gradients, and a distance that no motion outruns."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.geometry.shape_kernels import shape_row, shape_rows
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere, shape_table

Array = NDArray[np.float64]

KINDS = ("sphere", "capsule", "box", "half-space")


def a_shape(kind: str, rng: np.random.Generator) -> Shape:
    """Some shape of a few mm around the origin."""
    centre = rng.normal(0, 3, 3)
    if kind == "sphere":
        return Sphere(centre, rng.uniform(0.5, 5))
    if kind == "capsule":
        return CapsuleShape(centre, centre + rng.normal(0, 5, 3), rng.uniform(0.5, 4))
    if kind == "half-space":
        return HalfSpace(centre, rng.normal(0, 1, 3))
    placing = np.eye(4)
    placing[:3, :3], placing[:3, 3] = Rotation.random(random_state=rng).as_matrix(), centre
    return Box(placing, rng.uniform(0.5, 5, 3))


def row_of(shape: Shape, p: ArrayLike, d: ArrayLike, radius: float) -> Array:
    table = shape_table([shape])
    row = np.empty(10)
    shape_row(table.kind[0], table.data[0], np.asarray(p, float), np.asarray(d, float), radius, row)
    return row


def support(shape: Shape, u: Array) -> Array:
    """Furthest reach of a bounded shape in the directions u (n, 3): the oracle's only knowledge of a shape."""
    if isinstance(shape, Sphere):
        return u @ shape.centre + shape.radius
    if isinstance(shape, CapsuleShape):
        return np.maximum(u @ shape.start, u @ shape.end) + shape.radius
    assert isinstance(shape, Box)
    turn, centre = shape.transform_box_to_patient[:3, :3], shape.transform_box_to_patient[:3, 3]
    return u @ centre + np.abs(u @ turn) @ shape.half_size


def separation(shape: Shape, u: Array, p: Array, d: Array) -> Array:
    """How far a plane across each u parts the axis from the shape: a lower bound of the signed distance."""
    return np.minimum(u @ p, u @ (p + d)) - support(shape, u)


def oracle(shape: Shape, p: Array, d: Array, rng: np.random.Generator) -> float:
    """Signed distance of the axis: the best separating direction, by sampling and shrinking steps around the best."""
    if isinstance(shape, HalfSpace):
        return float(min(shape.normal @ (p - shape.point), shape.normal @ (p + d - shape.point)))
    u = rng.normal(size=(2000, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    value = separation(shape, u, p, d)
    few = np.argsort(value)[-8:]
    best, centre = value[few], u[few]
    for step in 0.3 * 0.8 ** np.arange(80):
        near = centre[:, None] + step * rng.normal(size=(8, 25, 3))
        near /= np.linalg.norm(near, axis=2, keepdims=True)
        value = separation(shape, near.reshape(-1, 3), p, d).reshape(8, 25)
        gather = value.argmax(axis=1)
        better = value[np.arange(8), gather] > best
        centre[better] = near[better, gather[better]]
        best = np.maximum(best, value.max(axis=1))
    return float(best.max())


@pytest.mark.parametrize("kind", KINDS)
def test_the_distance_is_the_best_separation(kind: str) -> None:
    """HAZ-08: outside the distance, inside minus the shortest way out, against sampled separating directions."""
    rng = np.random.default_rng(1)
    signs = set()
    for _ in range(60):
        shape, p, d = a_shape(kind, rng), rng.normal(0, 4, 3), rng.normal(0, 6, 3)
        if rng.random() < 0.2:
            d = np.zeros(3)
        found = row_of(shape, p, d, 0.7)[0] + 0.7
        expected = oracle(shape, p, d, rng)
        assert found >= expected - 1e-9  # the oracle is a lower bound …
        assert found <= expected + 5e-4  # … that comes this near; that no more is claimed, the next test shows to 1e-9
        signs.add(np.sign(found))
    assert signs == {-1.0, 1.0}


@pytest.mark.parametrize("kind", KINDS)
def test_the_pair_is_a_pair(kind: str) -> None:
    """Unit normal, a point on the axis, a point on the surface, and the distance between them along the normal."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        shape, p, d = a_shape(kind, rng), rng.normal(0, 4, 3), rng.normal(0, 6, 3)
        row = row_of(shape, p, d, 0.7)
        normal, on_tool, on_surface = row[1:4], row[4:7], row[7:10]
        assert abs(np.linalg.norm(normal) - 1) < 1e-12
        assert abs(normal @ (on_tool - on_surface) - 0.7 - row[0]) < 1e-11
        t = float((on_tool - p) @ d / (d @ d))
        assert -1e-12 <= t <= 1 + 1e-12
        assert np.linalg.norm(p + t * d - on_tool) < 1e-11
        # The point on the surface: at distance 0 itself.
        assert abs(row_of(shape, on_surface, np.zeros(3), 0.0)[0]) < 1e-9
        if not isinstance(shape, HalfSpace):
            assert separation(shape, normal[None], p, d)[0] == pytest.approx(row[0] + 0.7, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_the_normal_is_the_gradient(kind: str) -> None:
    """Central differences of both ends' motion: normal · motion of the point on the axis, inside as well as outside."""
    rng = np.random.default_rng(3)
    h, sharp, inside = 1e-6, 0, 0
    for _ in range(300):
        shape, p, d = a_shape(kind, rng), rng.normal(0, 4, 3), rng.normal(0, 6, 3)
        row = row_of(shape, p, d, 0.7)
        t = float((row[4:7] - p) @ d / (d @ d))
        one, two = rng.normal(0, 1, 3), rng.normal(0, 1, 3)
        ahead = row_of(shape, p + h * one, d + h * (two - one), 0.7)[0]
        back = row_of(shape, p - h * one, d - h * (two - one), 0.7)[0]
        predicted = row[1:4] @ ((1 - t) * one + t * two)
        if abs((ahead + back) / 2 - row[0]) > 1e-9:
            sharp += 1  # a crease of the distance within h: it has no gradient there
            continue
        inside += row[0] < -0.7
        assert abs((ahead - back) / (2 * h) - predicted) < 1e-4
    assert sharp < 10
    assert inside > 25


small = st.floats(-6, 6, allow_nan=False).map(lambda v: round(v, 2))
vectors = st.tuples(small, small, small).map(np.array)
squeezed = st.tuples(vectors, st.sampled_from([1.0, 1e-3, 1e-8, 0.0])).map(lambda pair: pair[0] * pair[1])


@settings(max_examples=400, deadline=None)
@given(st.sampled_from(KINDS), st.integers(0, 40), vectors, squeezed, squeezed, squeezed, st.booleans())
def test_no_motion_outruns_the_distance(
    kind: str, seed: int, p: Array, d: Array, one: Array, two: Array, along: bool
) -> None:
    """HAZ-02: the distance changes by no more than the larger motion of the two ends; every row is finite."""
    rng = np.random.default_rng(seed)
    shape = a_shape(kind, rng)
    if along and isinstance(shape, Box):  # parallel to an edge, start on a corner of the box
        turn = shape.transform_box_to_patient[:3, :3]
        p, d = shape.transform_box_to_patient[:3, 3] + turn @ shape.half_size, turn[:, 0] * d[0]
    if along and isinstance(shape, CapsuleShape):
        p, d = shape.start, (shape.end - shape.start) * d[0]
    before, after = row_of(shape, p, d, 0.5), row_of(shape, p + one, d + two - one, 0.5)
    assert np.isfinite(before).all()
    assert np.isfinite(after).all()
    assert abs(np.linalg.norm(after[1:4]) - 1) < 1e-12
    moved = max(np.linalg.norm(one), np.linalg.norm(two))
    assert abs(after[0] - before[0]) <= moved + 1e-9


def test_a_few_distances_by_hand() -> None:
    """Inside as well: minus the shortest way out."""
    box = Box(np.eye(4), [3.0, 2.0, 1.0])
    through = np.array([0.0, 0, -20]), np.array([0.0, 0, 40.0])
    assert row_of(box, *through, 0.5)[:4] == pytest.approx([-2.5, 0, -1, 0], abs=1e-12) or row_of(box, *through, 0.5)[
        :4
    ] == pytest.approx([-2.5, 0, 1, 0], abs=1e-12)
    assert row_of(box, [0, 0, 3.0], np.zeros(3), 0.5)[:4] == pytest.approx([1.5, 0, 0, 1])
    assert row_of(box, [0, 0, 0.75], np.zeros(3), 0.5)[:4] == pytest.approx([-0.75, 0, 0, 1])
    assert row_of(box, [6.0, 6, 1], np.zeros(3), 0.0)[:4] == pytest.approx([5.0, 0.6, 0.8, 0])
    plane = HalfSpace([0, 0, 1.0], [0, 0, 2.0])
    assert row_of(plane, [0, 0, 5.0], [1.0, 0, -6.0], 0.5)[:7] == pytest.approx([-2.5, 0, 0, 1, 1, 0, -1])
    ball = Sphere([0, 0, 0], 2.0)
    assert row_of(ball, [-5.0, 0, 0], [10.0, 0, 0], 0.5)[0] == pytest.approx(-2.5)


def test_the_ends_have_rows_of_their_own() -> None:
    """An axis along a face: the closest pair and both ends; what is beyond the threshold has none."""
    table = shape_table([HalfSpace([0, 0, 0], [0, 0, 1]), Sphere([0, 0, 0], 1.0)])
    rows = np.empty((6, 10))
    p, d = np.array([-50.0, 0, 2]), np.array([100.0, 0, 0])
    found, least = shape_rows(table.kind[0], table.data[0], p, d, 1.0, 3.0, rows, 0)
    assert (found, least) == (2, 1.0)
    assert {tuple(r) for r in rows[:2, 4:7]} == {(-50.0, 0, 2), (50.0, 0, 2)}
    found, least = shape_rows(table.kind[1], table.data[1], p, d, 1.0, 3.0, rows, 2)
    assert (found, least) == (3, 0.0)
    assert rows[2, 4:7].tolist() == [0, 0, 2]
    found, least = shape_rows(table.kind[1], table.data[1], p + 10.0, d, 1.0, 3.0, rows, 0)
    assert found == 0
    assert least > 3.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Sphere([0, 0, np.nan], 1), "centre must be three finite"),
        (lambda: Sphere([0, 0], 1), "three finite numbers"),
        (lambda: Sphere("here", 1), "three numbers"),
        (lambda: Sphere([0, 0, 0], 0), "radius is 0 mm"),
        (lambda: Sphere([0, 0, 0], np.nan), "radius is nan mm"),
        (lambda: Sphere([0, 0, 0], "wide"), "a number of mm"),  # type: ignore[arg-type]
        (lambda: Sphere([0, 0, 1e6], 1), "no patient"),
        (lambda: CapsuleShape([0, 0, 0], [0, 0, 1], -1), "radius is -1 mm"),
        (lambda: Box(np.diag([1.0, 1, -1, 1]), [1, 1, 1]), "not rigid"),
        (lambda: Box(np.eye(3), [1, 1, 1]), "not rigid"),
        (lambda: Box("box", [1, 1, 1]), "rigid transform"),
        (lambda: Box(np.eye(4), [1, 0, 1]), "positive, not 1, 0, 1"),
        (lambda: HalfSpace([0, 0, 0], [0, 0, 0]), "no direction"),
        (lambda: shape_table(["a ball"]), "not str"),  # type: ignore[list-item]
    ],
)
def test_nonsense_is_refused(make: object, words: str) -> None:
    """HAZ-05: each with its reason."""
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]


def test_a_shape_is_its_own_and_read_only() -> None:
    """What the caller changes later changes no zone."""
    centre, placing = np.zeros(3), np.eye(4)
    sphere, box = Sphere(centre, 1), Box(placing, np.ones(3))
    centre[0] = placing[0, 3] = 9.0
    table = shape_table([sphere, box])
    assert row_of(sphere, [3.0, 0, 0], np.zeros(3), 0.0)[0] == 2.0 == row_of(box, [3.0, 0, 0], np.zeros(3), 0.0)[0]
    assert not any(a.flags.writeable for a in (sphere.centre, box.half_size, table.kind, table.data))
