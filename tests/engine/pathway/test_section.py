"""A point against one segment: held against the printed steps of Kwok 2013, eq. 1-7, in 80-bit arithmetic."""

from __future__ import annotations

from itertools import pairwise

import lumen_shapes
import numpy as np
import pytest

from vfix_engine.pathway import packed
from vfix_engine.pathway.inner_line import inner_lines
from vfix_engine.pathway.packed import PackedPathway
from vfix_engine.pathway.query.query import deviation_of_points
from vfix_engine.pathway.query.section import section_distance, signed_distance

Long = np.longdouble


def printed(x: np.ndarray, segment: PackedPathway, plane: np.ndarray | None = None) -> float:
    """δ of the only segment with circular contours, step by step as printed; ``plane``: normal where eq. 1 has none."""
    row, (radius, next_radius) = segment.rows[0].astype(Long), segment.polar[:, 0].astype(Long)
    x, p, q, m, m_next = x.astype(Long), row[0:3], row[3:6], row[6:9], row[9:12]
    n = np.cross(p - x, q - x) if plane is None else plane.astype(Long)  # 1
    rho, rho_next = np.cross(n, m), np.cross(n, m_next)  # 2
    v2, v3 = p + radius * rho / np.sqrt(rho @ rho), q + next_radius * rho_next / np.sqrt(rho_next @ rho_next)  # 3
    kept = [axis for axis in range(3) if axis != int(np.abs(n).argmax())]
    corners = [(v - x)[kept] for v in (p, v2, v3, q, p)]
    area = [b[0] * a[1] - a[0] * b[1] for a, b in pairwise(corners)]  # 4
    if min(area) >= 0 or max(area) <= 0:
        return 0.0  # 5
    along = v3 - v2
    mu = np.clip((x - v2) @ along / (along @ along), 0, 1)  # 6
    away = x - ((1 - mu) * v2 + mu * v3)
    return float(np.sqrt(away @ away))  # 7


def random_segment(rng: np.random.Generator) -> PackedPathway:
    """Two circular contours, radii of 0.1 to 40 mm, leaning by up to 60°, anywhere; they do not cross."""
    while True:
        axis = unit(rng.normal(size=3))
        length = np.exp(rng.uniform(np.log(0.5), np.log(150.0)))
        tangent = np.array([leaning(axis, rng) for _ in range(2)])
        first = np.array([unit(np.cross(m, rng.normal(size=3))) for m in tangent])
        radius = np.exp(rng.uniform(np.log(0.1), np.log(40.0), (2, 1)))
        centre = rng.uniform(-300.0, 300.0, 3) + np.array([[0.0], [length]]) * axis
        sine = np.sqrt(np.maximum(1.0 - (tangent[0] @ tangent[1]) ** 2, 0.0))
        ahead = (tangent @ axis) * length > 1.01 * radius[::-1, 0] * sine
        if ahead.all():
            return packed.pack(centre, tangent, first, radius)


def leaning(axis: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0.0, np.radians(60.0))
    return np.cos(angle) * axis + np.sin(angle) * unit(np.cross(axis, rng.normal(size=3)))


def unit(vector: np.ndarray) -> np.ndarray:
    found: np.ndarray = vector / np.linalg.norm(vector)
    return found


def place(row: np.ndarray, t: float, h: float, turn: float) -> np.ndarray:
    """A point by its place along the axis, its distance from it and the angle about it."""
    axis = row[packed.AXIS : packed.AXIS + 3]
    one = unit(np.cross(axis, row[packed.START_SECOND : packed.START_SECOND + 3]))
    found: np.ndarray = row[:3] + t * axis + h * (np.cos(turn) * one + np.sin(turn) * np.cross(axis, one))
    return found


def test_it_is_what_the_printed_steps_give() -> None:
    rng = np.random.default_rng(1)
    outside = 0
    for _ in range(250):
        segment = random_segment(rng)
        row = segment.rows[0]
        for _ in range(8):
            size = max(row[packed.START_RADIUS], row[packed.END_RADIUS])
            t = rng.uniform(-0.5, 1.5) * row[packed.LENGTH]
            x = place(row, t, abs(rng.normal()) * size, rng.uniform(0.0, 6.3))
            signed, *nearest = signed_distance(*x, *segment, 0)
            wanted = printed(x, segment)
            assert abs(max(signed, 0.0) - wanted) < 1e-11
            assert abs(np.linalg.norm(x - nearest) - abs(signed)) < 1e-11
            outside += wanted > 0.0
    assert 500 < outside < 1900


def test_on_the_axis_the_section_goes_through_the_first_direction() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        segment = random_segment(rng)
        row = segment.rows[0]
        axis, length = row[packed.AXIS : packed.AXIS + 3], row[packed.LENGTH]
        plane = np.cross(axis, row[packed.START_FIRST : packed.START_FIRST + 3])
        for t in (-0.7 * length, -3.0, 0.0, 0.2 * length, 0.99 * length, length, length + 5.0):
            x = row[:3] + t * axis
            signed = signed_distance(*x, *segment, 0)[0]
            if 0.0 <= t <= length:
                assert signed <= 0.0
            else:
                assert abs(signed - printed(x, segment, plane)) < 1e-9


def test_a_cylinder_and_a_cone_are_what_they_are() -> None:
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.uniform(-30.0, 30.0, (500, 2)), rng.uniform(5.0, 295.0, 500)])
    off = np.linalg.norm(points[:, :2], axis=1)
    cylinder = lumen_shapes.straight().packed()
    assert np.abs(deviation_of_points(points, cylinder, 0, 32)[0] - np.maximum(off - 12.0, 0.0)).max() < 1e-12
    # One segment that widens from 5 to 20 mm: distance to its wall's line, clamped to its ends.
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    cone = packed.pack(300.0 * up * [[0.0], [1.0]], up, np.array([[1.0, 0.0, 0.0]] * 2), np.array([[5.0], [20.0]]))
    line = np.array([300.0, 15.0])
    share = np.clip(((points[:, 2] * line[0]) + (off - 5.0) * line[1]) / (line @ line), 0.0, 1.0)
    wall = np.hypot(points[:, 2] - share * line[0], off - 5.0 - share * line[1])
    wanted = np.where(off <= 5.0 + points[:, 2] * 0.05, 0.0, wall)
    assert np.abs(deviation_of_points(points, cone, 0, 1)[0] - wanted).max() < 1e-12


@pytest.mark.parametrize("angles", [1, 28])
def test_there_are_no_cracks_between_segments(angles: int) -> None:
    """Points on the contours' own planes, which rounding puts on either side."""
    rng = np.random.default_rng(4)
    pathway = lumen_shapes.arc(angles=angles)
    contours = pathway.contours(extended=True)
    second = np.cross(contours.tangent, contours.first)
    for j in range(1, len(contours.s) - 1):
        turn, share = rng.uniform(0.0, 6.3, 20), rng.uniform(0.0, 1.0, 20)
        ray = np.cos(turn)[:, None] * contours.first[j] + np.sin(turn)[:, None] * second[j]
        points = contours.centre[j] + (share * contours.radius[j].min() * (1.0 - 1e-9))[:, None] * ray
        assert deviation_of_points(points, pathway.packed(), j - 1, j + 1)[0].max() == 0.0


@pytest.mark.parametrize("angles", [1, 28])
def test_it_is_continuous_from_segment_to_segment(angles: int) -> None:
    rng = np.random.default_rng(5)
    pathway = lumen_shapes.helix(angles=angles)
    rows = pathway.packed().rows
    for j in range(2, len(rows) - 2, 3):
        across = np.cross(rows[j, 6:9], rng.normal(size=(50, 3)))
        on_plane = rows[j, :3] + rng.uniform(0.0, 25.0, (50, 1)) * across / np.linalg.norm(across, axis=1)[:, None]
        step = 1e-7 * rows[j, 6:9]
        before, after = (
            deviation_of_points(on_plane + way, pathway.packed(), j - 2, j + 2)[0] for way in (-step, step)
        )
        assert np.abs(before - after).max() < 1e-6


def test_it_does_not_depend_on_where_it_lies() -> None:
    rng = np.random.default_rng(6)
    for angles in (1, 9):
        found = lumen_shapes.arc(angles=angles).contours()
        points = rng.uniform(-30.0, 110.0, (200, 3))
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        here = packed.pack(found.centre, found.tangent, found.first, found.radius)
        there = packed.pack(found.centre @ turn.T + 50.0, found.tangent @ turn.T, found.first @ turn.T, found.radius)
        one = deviation_of_points(points, here, 0, 30)[0]
        assert one.min() == 0.0 < one.max()
        assert np.abs(one - deviation_of_points(points @ turn.T + 50.0, there, 0, 30)[0]).max() < 1e-11


def test_polar_radii_are_met_at_their_angles_and_linear_between() -> None:
    up = np.array([[0.0, 0.0, 1.0]] * 2)
    radius = np.array([[10.0, 14.0, 11.0, 8.0, 9.0]] * 2)
    tube = packed.pack(100.0 * up * [[0.0], [1.0]], up, np.array([[1.0, 0.0, 0.0]] * 2), radius)
    turn = 2.0 * np.pi * np.arange(50) / 50
    wanted = np.interp(turn, 2.0 * np.pi * np.arange(6) / 5, np.append(radius[0], radius[0, 0]))
    for psi, wall in zip(turn, wanted, strict=True):
        for off in (0.5, 20.0):
            x = off * np.cos(psi), off * np.sin(psi), 50.0
            assert abs(signed_distance(*x, *tube, 0)[0] - (off - wall)) < 1e-12
    # A hair below the angle 0 it is the radius at 0.
    for off in (0.5, 20.0):
        for hair in (0.0, -1e-18, -1e-300):
            assert abs(signed_distance(off, hair, 50.0, *tube, 0)[0] - (off - 10.0)) < 1e-12
    # All radii alike make circles.
    alike = packed.pack(100.0 * up * [[0.0], [1.0]], up, np.array([[1.0, 0.0, 0.0]] * 2), np.full((2, 7), 9.0))
    assert abs(signed_distance(3.0, -15.0, 60.0, *alike, 0)[0] - (np.hypot(3.0, 15.0) - 9.0)) < 1e-12


def test_compiled_it_is_the_same_function() -> None:
    rng = np.random.default_rng(7)
    assert section_distance.py_func is signed_distance  # type: ignore[attr-defined]
    for shape in (lumen_shapes.helix(), lumen_shapes.arc(angles=28)):
        rows, polar = shape.packed()
        for _ in range(100):
            x, j = rng.uniform(-80.0, 120.0, 3), int(rng.integers(len(rows)))
            one, other = signed_distance(*x, rows, polar, j), section_distance(*x, rows, polar, j)
            assert np.abs(np.subtract(one, other)).max() < 1e-11
        assert np.isnan(signed_distance(np.nan, 0.0, 0.0, rows, polar, 3)[0])
        assert np.isnan(section_distance(np.nan, 0.0, 0.0, rows, polar, 3)[0])


def test_the_line_below_the_wall_bounds_the_deviation_between_the_planes() -> None:
    rng = np.random.default_rng(8)
    tight, asked = 0.0, 0
    for _ in range(400):
        segment = random_segment(rng)
        row = segment.rows[0]
        height, slope, factor = row[packed.INNER_LINE : packed.INNER_LINE + 3]
        for _ in range(5):
            t, h = rng.uniform(-0.3, 1.3) * row[packed.LENGTH], rng.uniform(0.0, 3.0) * row[packed.START_RADIUS]
            x = place(row, t, h, rng.uniform(0.0, 6.3))
            if (x - row[:3]) @ row[6:9] < 0.0 or (x - row[3:6]) @ row[9:12] > 0.0:
                continue
            gap = max(signed_distance(*x, *segment, 0)[0], 0.0)
            bound = factor * max(h - height - slope * t, 0.0)
            assert gap <= bound + 1e-9
            asked, tight = asked + 1, tight + (bound > 0.0 and gap > 0.5 * bound)
    assert asked > 500
    assert tight > 100
    straight = inner_lines(np.array([5.0, 20.0]), np.array([30.0]), (np.ones(1), np.ones(1)))
    assert straight[0] == pytest.approx([5.0, 0.5, 1.0, np.sqrt(1.25)])
