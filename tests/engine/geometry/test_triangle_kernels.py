"""The segment-triangle kernel, and the oracle for whole meshes, against exact arithmetic (HAZ-08)."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_oracle import every_distance, exact_distance, kernel
from hypothesis import given, settings
from hypothesis import strategies as st

_TINY = st.sampled_from([0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3])
_GRID = st.integers(-3, 3)


def check(p: np.ndarray, q: np.ndarray, triangle: np.ndarray) -> None:
    """Distance and points agree with the oracle to 1e-9 of the scale, and the points really have that distance."""
    distance, t, point, crosses = kernel(p, q, triangle)
    scale = 1.0 + max(np.abs(p).max(), np.abs(q).max(), np.abs(triangle).max())
    assert distance == pytest.approx(exact_distance(p, q, triangle), abs=1e-9 * scale)
    assert 0.0 <= t <= 1.0
    assert np.linalg.norm(p + t * (q - p) - point) == pytest.approx(distance, abs=1e-13 * scale)
    assert exact_distance(point, point, triangle) <= 1e-12 * scale
    assert not crosses or distance <= 1e-9 * scale


def test_random_pairs_match_exact_arithmetic() -> None:
    """HAZ-08: ordinary triangles and segments, near and far from each other."""
    random = np.random.default_rng(1)
    for _ in range(400):
        p, q, *corners = random.normal(size=(5, 3)) * 10.0 ** random.uniform(-2, 2, (5, 1))
        triangle = np.array(corners)
        check(p, q, triangle)
        scale = 1.0 + max(np.abs(p).max(), np.abs(q).max(), np.abs(triangle).max())
        assert every_distance(p, q, triangle)[0] == pytest.approx(exact_distance(p, q, triangle), abs=1e-9 * scale)


@settings(max_examples=400, deadline=None, derandomize=True)
@given(
    st.lists(st.tuples(_GRID, _GRID, _GRID), min_size=5, max_size=5),
    st.lists(st.tuples(_TINY, _TINY, _TINY), min_size=5, max_size=5),
)
def test_near_degenerate_pairs_match_exact_arithmetic(
    grid: list[tuple[int, int, int]], nudge: list[tuple[float, float, float]]
) -> None:
    """HAZ-08: on a coarse grid with tiny nudges parallel, touching, crossing, collinear and coinciding cases abound."""
    p, q, *corners = np.array(grid, dtype=float) + np.array(nudge)
    check(p, q, np.array(corners))


@pytest.mark.parametrize("width", [0.0, 1e-14, 1e-10, 1e-8, 1e-6, 1e-4])
def test_needles_and_nearly_parallel_segments(width: float) -> None:
    """HAZ-08: triangles thin as a needle, and segments almost along them, crossing, beside and inside."""
    random = np.random.default_rng(2)
    for _ in range(40):
        a, along, across, up = random.normal(size=(4, 3))
        triangle = np.array([a, a + along, a + random.uniform() * along + width * across])
        start = a + random.uniform(-0.2, 1.2) * along + random.choice([0.0, 0.3, 1.0]) * width * across
        check(start - width * up, start + random.choice([0.0, 1.0]) * along + width * up, triangle)


def test_crossing_and_point_cases() -> None:
    """HAZ-08: a segment through the face, one that ends on it, a point above it, a triangle that is a point."""
    triangle = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]])
    assert kernel(np.array([0.5, 0.5, -1.0]), np.array([0.5, 0.5, 1.0]), triangle)[::3] == (0.0, True)
    check(np.array([0.5, 0.5, 1.0]), np.array([0.5, 0.5, 0.0]), triangle)
    assert kernel(np.array([0.5, 0.5, 3.0]), np.array([0.5, 0.5, 3.0]), triangle)[0] == 3.0
    point = np.zeros((3, 3))
    assert kernel(np.array([-1.0, 1, 0]), np.array([1.0, 1, 0]), point)[0] == 1.0
