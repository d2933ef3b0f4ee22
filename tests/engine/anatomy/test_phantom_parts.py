"""Every anatomical part says where it is, and its distance is one."""

from __future__ import annotations

import numpy as np
import pytest

from head_phantom.blending import receded, union, without
from head_phantom.noise import SmoothNoise
from head_phantom.parts import cranium, face, jaws, neck, nose, sinuses, soft
from head_phantom.shapes import Ellipsoid, Part, Plate, Points, Tube, polygon

PARTS: list[Part] = [
    part
    for module in (cranium, face, jaws, nose, sinuses, soft)
    for group in vars(module).values()
    if isinstance(group, tuple) and group and isinstance(group[0], Part)
    for part in group
]
PARTS += [
    *neck.vertebrae(),
    *(Part(sinus.name, sinus.left) for sinus in sinuses.SINUSES),
    *(Part(turbinate.name, turbinate.with_mucosa) for turbinate in nose.TURBINATES),
    Part("bony septum", nose.BONY_SEPTUM),
    Part("septum", nose.SEPTUM_WITH_MUCOSA),
]


def at(points: np.ndarray) -> Points:
    columns = points.astype(np.float32).T
    return Points(*(column[:, None, None] for column in columns))


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_a_part_lies_in_its_box(part: Part) -> None:
    low, high = np.array(part.shape.box)
    random = np.random.default_rng(1)
    around = random.uniform(low - 6.0, high + 6.0, (4000, 3))
    inside = part.shape.distance(at(around)).ravel() < 0
    outside_box = ((around < low - 0.6) | (around > high + 0.6)).any(axis=1)
    assert not (inside & outside_box).any()
    within = random.uniform(low, high, (4000, 3))
    assert (part.shape.distance(at(within)) < 0).any()


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_a_distance_never_changes_faster_than_the_way(part: Part) -> None:
    """Or a seam or a shell would be thicker than told. Stretched solids are bounds: they may change more slowly."""
    low, high = np.array(part.shape.box)
    random = np.random.default_rng(2)
    start = random.uniform(low - 2.0, high + 2.0, (3000, 3))
    step = random.normal(size=start.shape)
    step *= 0.05 / np.linalg.norm(step, axis=1, keepdims=True)
    before, after = (part.shape.distance(at(p)).ravel() for p in (start, start + step))
    near = np.abs(before) < 2.0
    assert np.quantile(np.abs(after - before)[near] / 0.05, 0.97) < 1.6


def test_round_solids_are_exact() -> None:
    points = np.random.default_rng(3).uniform(-9, 9, (500, 3))
    ball = Ellipsoid((1, 2, 3), (4, 4, 4)).distance(at(points)).ravel()
    np.testing.assert_allclose(ball, np.linalg.norm(points - [1, 2, 3], axis=1) - 4, atol=1e-5)
    rod = Tube([(-5, 0, 0), (5, 0, 0)], [2, 2]).distance(at(points)).ravel()
    along = np.clip(points[:, 0], -5, 5)
    expected = np.hypot(np.hypot(points[:, 0] - along, points[:, 1]), points[:, 2]) - 2
    np.testing.assert_allclose(rod, expected, atol=1e-5)


def test_a_polygon_knows_inside_from_outside() -> None:
    corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)]
    u, v = np.array([1, 3, 3, -1, 1], np.float32), np.array([1, 1, 3, 1, 5], np.float32)
    np.testing.assert_allclose(polygon(u, v, corners), [-1, -1, 1, 1, 1], atol=1e-6)


def test_a_plate_is_as_thick_as_told() -> None:
    plate = Plate([(0, 0), (10, 0), (10, 10), (0, 10)], 3.0, 0.5, rounding=0.0)
    across = plate.distance(at(np.array([[2.5, 5, 5], [3, 5, 5], [3.5, 5, 5], [4, 5, 5]]))).ravel()
    np.testing.assert_allclose(across, [0, -0.5, 0, 0.5], atol=1e-6)


def test_a_seam_fills_and_a_cavity_recedes() -> None:
    a, b = np.array([1.0, 0.0, -3], np.float32), np.array([1.0, 4.0, -3], np.float32)
    np.testing.assert_allclose(union(a, b, 2.0), [0.5, 0.0, -3.5], atol=1e-6)
    np.testing.assert_allclose(union(a, b), [1, 0, -3], atol=1e-6)
    np.testing.assert_allclose(without(a, b), [1, 0, 3], atol=1e-6)
    # where the earlier cavity begins, the later one has ended by the thickness of the wall
    np.testing.assert_allclose(receded(np.float32([-5.0]), np.float32([0.0]), 1.2, 0.0), [1.2], atol=1e-6)


def test_noise_is_a_function_of_position() -> None:
    low, high = np.array([-20.0, -20, -20]), np.array([20.0, 20, 20])
    noise = SmoothNoise(7, 9.0, low, high)
    x, y, z = np.arange(-10.0, 10), np.arange(-5.0, 5), np.arange(0.0, 8)
    whole, part = noise.at(x, y, z), noise.at(x[4:9], y[2:], z[3:5])
    np.testing.assert_array_equal(part, whole[3:5, 2:, 4:9])
    assert 0.3 < noise.at(*[np.arange(-20.0, 20)] * 3).std() < 1.2
