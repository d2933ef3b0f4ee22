"""The order of points against brute force, symmetric layouts, and how often the pair that is off is named."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from registration_cases import BEADS, placed, some_pose
from scipy.optimize import brentq

from vfix_engine.errors import InputError
from vfix_engine.registration import find_outlier, match_points, register_points


def measured(points: np.ndarray, seed: int, sigma: float = 0.3) -> np.ndarray:
    random = np.random.default_rng(seed)
    return placed(some_pose(seed), points) + random.normal(0.0, sigma, points.shape)


@pytest.mark.parametrize("seed", range(20))
def test_the_order_of_five_beads_is_found(seed: int) -> None:
    order = np.random.default_rng(seed).permutation(5)
    found = match_points(measured(BEADS, seed)[order], BEADS)
    assert (found.moving == order).all()
    assert (found.fixed == np.arange(5)).all()
    assert not found.ambiguous
    assert found.second_fre_mm is not None
    assert found.second_fre_mm > 20.0 * found.fre_mm


@pytest.mark.parametrize(("count", "larger"), [(3, 3), (4, 4), (5, 5), (4, 6), (3, 6), (5, 6)])
def test_it_is_the_best_of_all_orders(count: int, larger: int) -> None:
    """Brute force: every order of random points with much noise is fitted, whichever set is the larger."""
    random = np.random.default_rng(count * 10 + larger)
    many = random.normal(0.0, 40.0, (larger, 3))
    few = placed(some_pose(count), many[random.permutation(larger)[:count]]) + random.normal(0.0, 4.0, (count, 3))
    tried = sorted(
        (register_points(few, many[list(order)]).fre_mm, order) for order in permutations(range(larger), count)
    )
    found = match_points(few, many)
    assert found.fre_mm == pytest.approx(tried[0][0], rel=1e-9)
    assert tuple(found.moving) == tried[0][1]
    assert found.second_fre_mm == pytest.approx(tried[1][0], rel=1e-9)
    swapped = match_points(many, few)
    assert sorted(zip(swapped.moving, swapped.fixed, strict=True)) == list(enumerate(tried[0][1]))
    assert swapped.fre_mm == pytest.approx(tried[0][0], rel=1e-9)
    assert swapped.registration.fixed == pytest.approx(many[swapped.fixed])


def test_eight_points_and_a_few_among_many() -> None:
    random = np.random.default_rng(8)
    many = random.uniform(-80.0, 80.0, (20, 3))
    chosen = random.permutation(20)[:8]
    assert (match_points(measured(many[chosen], 1), many).moving == chosen).all()
    order = random.permutation(8)
    assert (match_points(measured(many[:8], 2)[order], many[:8]).moving == order).all()


def test_a_symmetric_layout_is_asked_about() -> None:
    """A rectangle turns onto itself by half a turn about three axes: four orders fit alike, all are returned."""
    flat = np.array([(30.0, 20.0, 0.0), (-30.0, 20.0, 0.0), (-30.0, -20.0, 0.0), (30.0, -20.0, 0.0)])
    found = match_points(measured(flat, 3, 0.1), flat)
    assert found.ambiguous
    assert len(found.candidates) == 4
    assert {tuple(one.moving) for one in found.candidates} == {(0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)}
    assert [one.fre_mm for one in found.candidates] == sorted(one.fre_mm for one in found.candidates)


def test_a_mirrored_layout_is_told_apart() -> None:
    """A tetrahedron whose mirror image has the same distances in another order."""
    shape = np.array([(0.0, 0.0, 0.0), (55.0, 0.0, 0.0), (20.0, 30.0, 10.0), (20.0, -30.0, 10.0), (20.0, 5.0, 40.0)])
    shape[4, 1] = 0.0  # now y -> -y swaps the third and the fourth
    found = match_points(measured(shape[[0, 1, 3, 2, 4]], 5, 0.1), shape)
    assert tuple(found.moving) == (0, 1, 3, 2, 4)
    assert not found.ambiguous


@pytest.mark.parametrize(("fre_mm", "asked"), [(0.9, True), (1.1, False)])
def test_a_second_order_below_a_millimetre_is_asked_about(fre_mm: float, asked: bool) -> None:
    """However well the best one fits: points are not measured so well that it could be told from chance."""
    side = 60.0
    # An isosceles triangle that its third side tells from an equilateral one: turned by a third it is off by so much.
    triangle = np.array([(0.0, 0.0, 0.0), (side, 0.0, 0.0), (side / 2, side * np.sqrt(0.75), 0.0)])

    def second(higher: float) -> float:
        points = triangle + np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (higher / 3, higher, 0.0)])
        return match_points(points, points).second_fre_mm or 0.0

    higher = brentq(lambda h: second(h) - fre_mm, 0.01, 20.0)
    points = triangle + np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (higher / 3, higher, 0.0)])
    found = match_points(points, points)
    assert found.fre_mm < 1e-9
    assert found.second_fre_mm == pytest.approx(fre_mm, rel=1e-3)
    assert found.ambiguous is asked


def test_points_on_a_line_among_others_do_not_hide_an_order_that_can_be_fitted() -> None:
    """The best-fitting subset is on a line and determines no rotation; the next one is 4 mm off, and is found."""
    few = np.array([(0.0, 0.0, 0.0), (50.0, 0.0, 0.0), (100.0, 3.0, 0.0)])
    on_a_line = np.array([(0.0, 0.0, 200.0), (50.0, 0.0, 200.0), (100.0, 0.0, 200.0)])
    beside = np.array([(0.0, 400.0, 0.0), (50.0, 408.0, 0.0), (100.0, 395.0, 0.0)])
    found = match_points(few, np.concatenate([on_a_line, beside]))
    assert set(found.moving.tolist()) == {3, 4, 5}
    assert found.second_fre_mm is not None
    assert found.second_fre_mm >= found.fre_mm


def test_what_cannot_be_matched_is_refused() -> None:
    random = np.random.default_rng(0)
    line = np.arange(12.0).reshape(4, 3) * 10.0
    for fixed, moving, words in (
        (BEADS[:2], BEADS, "too few"),
        (random.normal(size=(9, 3)) * 50, random.normal(size=(9, 3)) * 50, "too many"),
        (BEADS, random.normal(size=(41, 3)) * 50, "too many"),
        (line, line, "on a line"),
    ):
        with pytest.raises(InputError, match=words):
            match_points(fixed, moving)


@pytest.mark.parametrize(
    ("count", "off", "least", "named"),
    [(4, 2.0, 0.75, 0.5), (5, 2.0, 0.88, 0.78), (6, 2.0, 0.92, 0.88), (4, 5.0, 0.93, 0.9), (5, 5.0, 0.97, 0.97)],
)
def test_the_pair_that_is_off_is_named(count: int, off: float, least: float, named: float) -> None:
    """200 layouts, σ 0.3 mm per axis: share in which it lowers FRE most (of those named), and in which it is named."""
    random = np.random.default_rng(count)
    right = told = 0
    for _ in range(200):
        points = random.normal(size=(count, 3)) * 50.0
        if np.linalg.svd(points - points.mean(axis=0))[1][1] < 40.0:
            points = random.normal(size=(count, 3)) * 50.0
        fixed = points + random.normal(0.0, 0.3, points.shape)
        direction = random.normal(size=3)
        wrong = int(random.integers(count))
        fixed[wrong] += off * direction / np.linalg.norm(direction)
        found = find_outlier(fixed, points)
        told += found is not None
        right += found is not None and found.index == wrong
    assert right >= least * told
    assert told >= named * 200


def test_good_pairs_seldom_have_a_suspect_and_hardly_ever_an_outlier() -> None:
    found = [find_outlier(measured(BEADS, seed), BEADS) for seed in range(300)]
    assert sum(one is not None for one in found) < 90
    assert sum(one is not None and one.certainty == "outlier" for one in found) <= 3


def test_certainty_and_figures() -> None:
    fixed = measured(BEADS, 1, 0.05)
    far, near = fixed.copy(), fixed.copy()
    far[2, 0] += 4.0
    near[2, 0] += 1.2
    outlier, suspect = find_outlier(far, BEADS), find_outlier(near, BEADS)
    assert outlier is not None
    assert suspect is not None
    assert (outlier.index, outlier.certainty, suspect.index, suspect.certainty) == (2, "outlier", 2, "suspect")
    assert outlier.fre_mm == pytest.approx(register_points(far, BEADS).fre_mm)
    assert outlier.without.count == 4
    assert outlier.without.fre_mm < 0.2
    assert outlier.off_mm == pytest.approx(4.0, abs=0.4)
    ignored = find_outlier(far, BEADS, [1, 1, 0, 1, 1])
    assert ignored is None or (ignored.index != 2 and ignored.certainty == "suspect")


def test_nothing_is_named_without_enough_pairs_or_without_residuals() -> None:
    assert find_outlier(BEADS, BEADS) is None
    assert find_outlier(measured(BEADS[:3], 1), BEADS[:3]) is None
    assert find_outlier(measured(BEADS, 1), BEADS, [1, 1, 1, 0, 0]) is None
    exact = BEADS.copy()
    exact[1] += [0.0, 3.0, 0.0]
    found = find_outlier(exact, BEADS)
    assert found is not None
    assert (found.index, found.certainty) == (1, "outlier")
    with pytest.raises(InputError):
        find_outlier(BEADS[:2], BEADS[:2])
