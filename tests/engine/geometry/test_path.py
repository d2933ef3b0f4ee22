"""The spline path against scipy's spline and quadrature."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import make_interp_spline

from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath

POINTS = np.random.default_rng(21).normal(size=(9, 3)).cumsum(axis=0) * 8.0


def reference(points: np.ndarray) -> tuple[object, np.ndarray]:
    u = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return make_interp_spline(u, points, k=min(5, len(points) - 1)), u


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 9])
def test_arc_length_is_exact(count: int) -> None:
    """Length by adaptive quadrature; the point at s has that arc behind it, to 1e-6 mm."""
    path = SplinePath(POINTS[:count])
    assert path.degree == min(5, count - 1)
    spline, u = reference(POINTS[:count])
    speed = spline.derivative()

    def arc(end: float) -> float:
        knots = np.unique(spline.t)
        knots = np.append(knots[knots < end], end)
        return sum(
            quad(lambda x: float(np.linalg.norm(speed(x))), a, b, epsabs=1e-10, limit=200)[0]
            for a, b in pairwise(knots)
        )

    assert path.length == pytest.approx(arc(u[-1]), abs=1e-7)
    for end in np.linspace(0.05, 0.95, 6) * u[-1]:
        assert path.position(arc(end)) == pytest.approx(spline(end), abs=1e-6)
        assert path.tangent(arc(end)) == pytest.approx(speed(end) / np.linalg.norm(speed(end)), abs=1e-6)


def test_it_passes_through_its_points_and_ends() -> None:
    """Control points lie on the curve; s outside the path gives the ends."""
    path = SplinePath(POINTS)
    for point in POINTS:
        assert np.linalg.norm(path.closest(point)[1] - point) < 1e-6
    assert path.position([-1.0, path.length + 1.0]) == pytest.approx(POINTS[[0, -1]], abs=1e-12)
    assert np.linalg.norm(path.tangent(np.linspace(0, path.length, 50)), axis=1) == pytest.approx(np.ones(50))


def test_closest_is_the_global_minimum() -> None:
    """HAZ-08: never farther than the best of a dense sample, with s, position and tangent of one place."""
    path, random = SplinePath(POINTS), np.random.default_rng(22)
    dense = path.position(np.linspace(0, path.length, 20001))
    for _ in range(300):
        target = path.position(random.uniform(0, path.length)) + random.normal(size=3) * random.choice([0, 0.1, 3, 30])
        s, position, tangent = path.closest(target)
        best = np.linalg.norm(dense - target, axis=1).min()
        assert np.linalg.norm(position - target) <= best + 1e-9
        assert position == pytest.approx(path.position(s), abs=1e-8)
        assert tangent == pytest.approx(path.tangent(s), abs=1e-7)
        if 1e-9 < s < path.length - 1e-9:
            assert abs((position - target) @ tangent) < 1e-6 * (1.0 + best)


def test_a_window_keeps_the_branch() -> None:
    """A path that comes back beside itself: progress stays where it is."""
    path = SplinePath([[0, 0, 0], [20, 0, 0], [21, 1, 0], [20, 2, 0], [0, 2, 0]], degree=1)
    target = [10.0, 1.8, 0.0]
    assert path.closest(target)[1] == pytest.approx([10, 2, 0])
    s, position, _ = path.closest(target, near_s=9.0, window=3.0)
    assert (s, *position) == pytest.approx((10, 10, 0, 0))
    assert path.closest(target, near_s=5.0, window=2.0)[0] == pytest.approx(7.0)
    assert path.closest(target, near_s=5.0, window=0.0)[0] == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0, 0, 0]], "at least two"),
        ([[0, 0, 0], [0, 0, 0]], "points 1 and 2"),
        ([[0, 0, 0], [1, np.nan, 0]], "point 2"),
        ([[0, 0], [1, 1]], "at least two"),
    ],
)
def test_bad_points_are_refused(points: list[list[float]], words: str) -> None:
    """HAZ-05: the message says which point is wrong."""
    with pytest.raises(PlanError, match=words):
        SplinePath(points)
    with pytest.raises(PlanError, match="nearest"):
        SplinePath(POINTS).closest([np.nan, 0, 0])
