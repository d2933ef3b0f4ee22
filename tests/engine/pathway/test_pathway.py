"""The pathway: interpolation, what the query reads, and what is refused."""

from __future__ import annotations

import lumen_shapes
import numpy as np
import pytest
from lumen_shapes import SHAPES
from scipy.interpolate import PchipInterpolator

from vfix_engine.errors import PathwayError
from vfix_engine.pathway import packed
from vfix_engine.pathway.checks import clear_of_neighbours
from vfix_engine.pathway.interpolation import Interpolation
from vfix_engine.pathway.pathway import Pathway

# Interpolation


def test_of_197_contours_every_fourth_is_a_control_contour() -> None:
    pathway = SHAPES["interpolated"]
    found = pathway.contours()
    assert len(found.s) == 197
    assert np.abs(found.centre[::4] - pathway.centre).max() < 1e-11
    assert np.array_equal(found.radius[::4], pathway.radius)
    assert np.abs(found.s[::4] - pathway.at_s).max() < 1e-9
    assert pathway.length == pytest.approx(np.hypot(60.0, 40.0) * np.pi, abs=1e-4)
    assert pathway.curve().length == pytest.approx(pathway.length, abs=1e-4)


@pytest.mark.parametrize("count", [2, 3, 10, 50, 60, 100, 400])
def test_any_number_of_contours(count: int) -> None:
    pathway = lumen_shapes.straight(contours=50, count=count)
    found = pathway.contours()
    assert len(found.s) == count
    assert found.s[0] == 0.0
    assert found.s[-1] == pytest.approx(300.0)
    assert len(pathway.packed().rows) == count + 1
    assert len(lumen_shapes.straight(contours=50, count=count, closed_ends=True).packed().rows) == count - 1


def test_two_and_three_control_contours_are_enough() -> None:
    two = Pathway([[0, 0, 0], [0, 0, 50]], [10, 5], count=11)
    assert np.allclose(two.contours().radius[:, 0], np.linspace(10, 5, 11))
    three = Pathway([[0, 0, 0], [0, 5, 50], [0, 0, 100]], [10, 5, 7], count=11)
    assert np.abs(three.contours().centre[5] - [0, 5, 50]).max() < 1e-12


def test_radii_stay_between_their_neighbours() -> None:
    rng = np.random.default_rng(3)
    knots = np.cumsum(rng.uniform(1.0, 9.0, 50))
    between = Interpolation(knots, 197)
    values = rng.uniform(4.0, 20.0, (50, 5))
    values[10:13] = 7.0
    found = between.monotone(values)
    low, high = (choose(values[between.piece], values[between.piece + 1]) for choose in (np.minimum, np.maximum))
    assert (found >= low).all()
    assert (found <= high).all()
    # The same as scipy's, which is written for one pathway at rest and takes longer.
    assert np.abs(found - PchipInterpolator(knots, values)(between.places)).max() < 1e-12


def test_equal_polar_radii_are_a_circle() -> None:
    round_, polar = lumen_shapes.arc(), lumen_shapes.arc()
    polar = Pathway(polar.centre, np.tile(polar.radius, (1, 28)), polar.count, polar.tangent)
    assert np.array_equal(round_.packed().rows[:, : packed.LIPSCHITZ], polar.packed().rows[:, : packed.LIPSCHITZ])
    assert np.array_equal(polar.packed().polar, np.tile(round_.packed().polar, (1, 28)))


def test_given_normals_are_kept() -> None:
    tangent = np.tile([0.0, 0.1, np.sqrt(0.99)], (31, 1))
    pathway = lumen_shapes.straight(tangent=tangent)
    assert np.abs(pathway.contours().tangent - tangent).max() < 1e-12


def test_the_polar_angle_zero_is_where_it_is_asked_for() -> None:
    first = lumen_shapes.straight(first=[0.0, 3.0, 7.0]).contours().first
    assert np.abs(first - [0.0, 1.0, 0.0]).max() < 1e-12


# What the query reads


@pytest.mark.parametrize("name", SHAPES)
def test_rows_say_what_they_must(name: str) -> None:
    rng = np.random.default_rng(5)
    pathway = SHAPES[name]
    rows, polar = pathway.packed()
    found = pathway.contours(extended=True)
    assert rows.shape == (len(found.s) - 1, packed.ROW)
    assert rows.flags.c_contiguous
    assert not rows.flags.writeable
    assert np.array_equal(rows[:, packed.START : 3], found.centre[:-1])
    assert np.allclose(rows[:, packed.AXIS : 22] * rows[:, packed.LENGTH, None], np.diff(found.centre, axis=0))
    assert np.allclose(np.cross(rows[:, 9:12], rows[:, packed.END_FIRST : 32]), rows[:, packed.END_SECOND : 35])
    assert np.array_equal(rows[:, packed.START_RADIUS], polar[:-1].max(axis=1))
    # Every rim point of both contours lies in the ball.
    angles = 2.0 * np.pi * np.arange(polar.shape[1]) / polar.shape[1] if polar.shape[1] > 1 else rng.uniform(0, 6.3, 9)
    second = np.cross(found.tangent, found.first)
    ray = np.cos(angles)[:, None] * found.first[:, None] + np.sin(angles)[:, None] * second[:, None]
    rim = found.centre[:, None] + polar[:, :, None] * ray
    for here in (rim[:-1], rim[1:]):
        away = np.linalg.norm(here - rows[:, None, packed.BALL : 17], axis=2).max(axis=1)
        assert (away <= rows[:, packed.BALL_RADIUS]).all()
        # Nothing of the rims is nearer to the axis line than the inscribed radius.
        out = here - rows[:, None, :3]
        out -= np.einsum("sai,si->sa", out, rows[:, packed.AXIS : 22])[..., None] * rows[:, None, packed.AXIS : 22]
        assert (np.linalg.norm(out, axis=2).min(axis=1) >= rows[:, packed.INSCRIBED_RADIUS]).all()
    assert (rows[:, packed.INSCRIBED_RADIUS] > 0.0).all()
    assert (rows[:, packed.LIPSCHITZ] >= 1.0).all()
    assert (rows[:, packed.LIPSCHITZ] < 4.0).all()


def test_a_window_reaches_beyond_its_arc() -> None:
    pathway = lumen_shapes.straight()  # contours every 10 mm, segment 0 before the first
    assert pathway.window(101.0, 139.0) == (10, 16)
    assert pathway.window(-500.0, -400.0) == (0, 2)
    assert pathway.window(900.0, 1000.0)[1] == 32
    assert pathway.window(-1e9, 1e9) == (0, 32)
    rows = pathway.packed().rows
    for low, high in ((101.0, 139.0), (0.0, 0.0), (299.0, 310.0), (-30.0, 5.0)):
        first, last = pathway.window(low, high)
        assert 0 <= first < last <= len(rows)
        assert rows[first, 2] <= max(low, -24.0)
        assert rows[last - 1, 5] >= min(high, 324.0)
    assert lumen_shapes.straight(closed_ends=True).window(0.0, 5.0) == (0, 2)
    with pytest.raises(PathwayError, match="no window"):
        pathway.window(5.0, np.nan)


# Refusals


def changed(name: str, number: int, value: object, **more: object) -> dict:
    given = {"centre": np.array(SHAPES["arc"].centre), "radius": np.full(31, 12.0), "count": 31, **more}
    given[name][number] = value
    return given


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"centre": [[0, 0, 0]], "radius": [3]}, "at least 2 contours, not 1"),
        ({"centre": [[0, 0, 0], [0, 0, 9]], "radius": [3]}, r"\(2, 3\) and \(1, 1\)"),
        ({"centre": [[0, 0, 0], [0, 0, 9]], "radius": np.ones((2, 2))}, "not 2"),
        ({"centre": [[0, 0, 0], [0, 0, 9]], "radius": [3, 3], "count": 1}, "at least 2 contours, not 1"),
        ({"centre": [[0, 0, 0], [0, 0, 9]], "radius": [3, 3], "knots": [1, 1]}, "knots"),
        ({"centre": [[0, 0, 0], [0, 0, 9]], "radius": [3, 3], "first": [0, 0, 0]}, "polar angle 0"),
        (changed("centre", 4, np.nan), "centre of contour 5 is not finite"),
        (changed("radius", 6, np.inf), "radius of contour 7 is not finite"),
        (changed("radius", 8, 0.0), "contour 9 has the radius 0 mm"),
        (changed("radius", 8, -2.0), "contour 9 has the radius -2 mm"),
        (changed("radius", 2, 0.0, radius=np.where(np.eye(31, 7) > 0, 5.0, 4.0)), "contour 3 .* at angle 1 of 7"),
        (changed("centre", 9, SHAPES["arc"].centre[8]), "contours 9 and 10 have the same centre"),
        (changed("tangent", 3, [0, 0, 2.0], tangent=np.array(SHAPES["arc"].tangent)), "contour 4 has the length 2"),
        (changed("tangent", 3, [0, 1, 0], tangent=np.array(SHAPES["arc"].tangent)), "contours 3 and 4 do not face"),
        (changed("tangent", 3, np.nan, tangent=np.array(SHAPES["arc"].tangent)), "tangent of contour 4 is not finite"),
        ({"centre": [[0, 0, 0], [0, 0, 9]], "radius": [3, 3], "tangent": [[0, 0, 1]]}, "tangents have the shape"),
        ({"centre": SHAPES["arc"].centre, "radius": np.full(31, 85.0), "count": 31}, "contours .* cross: .* 85 mm"),
        ({"centre": SHAPES["arc"].centre, "radius": np.full((31, 28), 85.0), "count": 197}, "cross"),
    ],
)
def test_contours_that_cannot_be_used_are_refused(given: dict, says: str) -> None:
    with pytest.raises(PathwayError, match=says):
        Pathway(**given)


def test_how_far_a_circle_stays_before_its_neighbour_is_exact() -> None:
    """Against many points of the rims, as polar contours are tested."""
    found = lumen_shapes.helix(contours=12, radius=20.0).contours()
    along = np.diff(found.centre, axis=0)
    ahead = np.einsum("ij,ij->i", found.tangent[:-1], along), np.einsum("ij,ij->i", found.tangent[1:], along)
    circle_ = clear_of_neighbours(ahead, found.tangent, found.first, found.radius)
    many = clear_of_neighbours(ahead, found.tangent, found.first, np.tile(found.radius, (1, 3000)))
    assert np.abs(circle_ - many).max() < 1e-4
    assert (circle_ <= many + 1e-12).all()


def test_a_gap_is_refused() -> None:
    centre = np.zeros((12, 3))
    centre[:, 2] = 10.0 * np.arange(12)
    centre[7:, 2] += 160.0
    with pytest.raises(PathwayError, match=r"gap of 170 mm between contours 7 and 8; .* 140 mm"):
        Pathway(centre, np.full(12, 10.0))


def test_a_crossing_names_the_control_contours() -> None:
    with pytest.raises(PathwayError, match=r"of 197 \(from control contour \d+ on\) cross"):
        Pathway(SHAPES["arc"].centre, np.full(31, 90.0))


def test_what_a_pathway_is_made_of_is_not_changed() -> None:
    centre = np.array(SHAPES["arc"].centre)
    pathway = Pathway(centre, np.full(31, 12.0))
    centre[3] = 1e9
    assert pathway.centre[3, 0] < 1e3
    with pytest.raises(ValueError, match="read-only"):
        pathway.radius[0] = 1.0
