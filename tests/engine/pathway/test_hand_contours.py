"""Contours placed by hand among fitted ones: what they replace, what goes along, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from vfix_engine.errors import PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.pathway.hand_contours import HandContour, with_hand_contours
from vfix_engine.pathway.pathway import Pathway

SPACING, RADIUS = 20.0, 12.0


@pytest.fixture
def line() -> Curve:
    return Curve.through(np.column_stack([np.zeros(11), np.zeros(11), SPACING * np.arange(11)]))


@pytest.fixture
def fit(line: Curve) -> Pathway:
    knots = np.linspace(0.0, line.length, 11)
    return Pathway(line.position(knots), np.full(11, RADIUS), count=41, knots=knots)


def on_line(z: float, x: float = 0.0) -> np.ndarray:
    return np.array([x, 0.0, z])


def test_without_contours_by_hand_the_fit_stays(fit: Pathway, line: Curve) -> None:
    found = with_hand_contours(fit, line, [])
    assert not found.changed
    np.testing.assert_array_equal(found.pathway.radius, fit.radius)
    assert (found.of_hand == -1).all()
    assert found.curve is line


def test_a_contour_of_the_fit_is_resized_in_its_place(fit: Pathway, line: Curve) -> None:
    found = with_hand_contours(fit, line, [HandContour(on_line(61.0), np.array([7.0]), of_fit=True)])
    assert found.of_hand.tolist() == [-1, -1, -1, 0, *[-1] * 7]
    np.testing.assert_allclose(found.pathway.radius[:, 0], [12, 12, 12, 7, *[12] * 7])
    np.testing.assert_allclose(found.pathway.centre, fit.centre, atol=1e-9)
    at = found.pathway.contours()
    assert np.interp(60.0, at.s, at.radius[:, 0]) == pytest.approx(7.0)


def test_one_more_lies_between_its_neighbours_and_one_that_is_left_out_is_gone(fit: Pathway, line: Curve) -> None:
    added = HandContour(on_line(70.0), np.array([9.0]))
    gone = HandContour(on_line(140.0), np.zeros(0), of_fit=True)
    found = with_hand_contours(fit, line, [added, gone])
    np.testing.assert_allclose(found.pathway.at_s, [0, 20, 40, 60, 70, 80, 100, 120, 160, 180, 200], atol=1e-6)
    assert np.flatnonzero(found.of_hand == 0).tolist() == [4]
    assert found.pathway.count == 41


def test_the_way_and_the_neighbours_go_along_with_a_moved_contour(fit: Pathway, line: Curve) -> None:
    moved = HandContour(on_line(100.0), np.array([RADIUS]), on_line(100.0, 10.0), of_fit=True)
    found = with_hand_contours(fit, line, [moved])
    x = found.pathway.centre[:, 0]
    assert x[5] == pytest.approx(10.0)
    assert x[4] == pytest.approx(x[6])
    assert 4.0 < x[4] < 9.0
    np.testing.assert_allclose(x[[0, 1, 2, 8, 9, 10]], 0.0, atol=1e-9)
    assert found.curve.position(found.curve.closest(moved.centre))[0] == pytest.approx(10.0, abs=0.1)
    assert found.curve.length > line.length
    # no sharper than the robot of the paper bends, by half at most
    assert 1.0 / found.curve.bending(8.0).max() > 24.0


def test_polar_radii_make_every_contour_a_polar_one(fit: Pathway, line: Curve) -> None:
    radii = np.array([10.0, 10.0, 10.0, 4.0])
    found = with_hand_contours(fit, line, [HandContour(on_line(100.0), radii, of_fit=True)])
    assert found.pathway.radius.shape == (11, 4)
    np.testing.assert_allclose(found.pathway.radius[5], radii)
    np.testing.assert_allclose(found.pathway.radius[4], RADIUS)
    more = with_hand_contours(
        fit, line,
        [HandContour(on_line(100.0), radii, of_fit=True), HandContour(on_line(40.0), np.full(8, 9.0), of_fit=True)],
    )  # fmt: skip
    np.testing.assert_allclose(more.pathway.radius[5], [10, 10, 10, 10, 10, 7, 4, 7])


def test_a_radius_that_would_cross_its_neighbour_is_reduced_and_said_so() -> None:
    turn = np.linspace(0.0, np.pi / 2.0, 9)
    bend = Curve.through(40.0 * np.column_stack([np.sin(turn), np.zeros(9), 1.0 - np.cos(turn)]))
    knots = np.linspace(0.0, bend.length, 7)
    fit = Pathway(bend.position(knots), np.full(7, 10.0), count=25, knots=knots)
    wide = HandContour(bend.position(knots[3]), np.array([60.0]), of_fit=True)
    found = with_hand_contours(fit, bend, [wide])
    assert found.cut_mm[3] > 15.0
    assert found.pathway.radius[3, 0] == pytest.approx(60.0 - found.cut_mm[3])


def test_of_two_in_one_place_the_later_counts_and_one_off_the_way_is_left_out(fit: Pathway, line: Curve) -> None:
    one, two = (HandContour(on_line(100.0), np.array([radius]), of_fit=True) for radius in (5.0, 6.0))
    off = HandContour(on_line(100.0, 80.0), np.array([5.0]))
    found = with_hand_contours(fit, line, [one, two, off])
    assert found.pathway.radius[5, 0] == 6.0
    assert found.left_out == (2,)


@pytest.mark.parametrize(
    ("contour", "words"),
    [
        ((on_line(0.0), np.zeros(0), None, True), "choose another entry or end"),
        ((on_line(200.0), np.array([5.0]), on_line(200.0, 3.0), True), "choose another entry or end"),
        ((on_line(60.0), np.array([0.0]), None, True), "finite and positive"),
        ((on_line(60.0), np.array([np.nan]), None, True), "finite and positive"),
        ((on_line(60.0), np.array([5.0, 6.0]), None, True), "one radius, or 3"),
        ((on_line(60.0), np.zeros(0), None, False), "has a radius"),
        ((on_line(60.0), np.array([5.0]), on_line(130.0), True), "at most 60 mm"),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    fit: Pathway, line: Curve, contour: tuple[np.ndarray, np.ndarray, np.ndarray | None, bool], words: str
) -> None:
    with pytest.raises(PathwayError, match=words):
        with_hand_contours(fit, line, [HandContour(*contour)])


def test_a_contour_is_found_by_its_place_along_the_pathway(fit: Pathway, line: Curve) -> None:
    found = with_hand_contours(fit, line, [])
    assert [found.nearest(s) for s in (0.0, 29.0, 31.0, 200.0)] == [0, 1, 2, 10]
    for wrong in (-1.0, 220.0, np.nan):
        with pytest.raises(PathwayError, match="not on the way"):
            found.nearest(wrong)
