"""Sixteen triangles at once against the scalar kernel, which exact arithmetic checks (HAZ-08)."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_oracle import every_distance, exact_distance

from vfix_engine.proximity.block_kernels import LANES, QUERY, WORK, block_gaps, describe
from vfix_engine.proximity.box_simd import FACETS, PROBE, describe_single, facet_bounds, facet_gaps
from vfix_engine.proximity.bvh16_build import build_bvh16

_TINY = np.array([0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3])


def measured(p: np.ndarray, q: np.ndarray, triangles: np.ndarray, limit: float = np.inf) -> tuple[np.ndarray, ...]:
    """Distances (16,), t (16,) and points (16, 3) of one segment and 16 triangles."""
    query, work = np.empty(QUERY), np.empty(WORK)
    describe(p, q - p, query)
    within = block_gaps(np.ascontiguousarray(triangles.reshape(LANES, 9).T).ravel(), query, limit, work)
    assert within == (work[:LANES] <= limit * limit).sum()
    return np.sqrt(work[:LANES]), work[16:32].copy(), p + work[32:80].reshape(3, LANES).T


def check(p: np.ndarray, q: np.ndarray, triangles: np.ndarray) -> None:
    """Distances are the oracle's, and the points really have them."""
    distance, t, points = measured(p, q, triangles)
    scale = 1.0 + max(np.abs(p).max(), np.abs(q).max(), np.abs(triangles).max())
    truth = every_distance(p, q, triangles)
    assert np.abs(distance - truth).max() <= 1e-9 * scale
    assert ((t >= 0.0) & (t <= 1.0)).all()
    on_axis = p + t[:, None] * (q - p)
    assert np.linalg.norm(on_axis - points, axis=1) == pytest.approx(distance, abs=1e-12 * scale)
    assert every_distance(points[0], points[0], triangles[:1]) <= 1e-12 * scale
    limit = float(np.median(truth))
    near = measured(p, q, triangles, limit)[0]
    assert np.abs(near - truth)[truth <= limit - 1e-9 * scale].max(initial=0.0) <= 1e-9 * scale
    assert (near[truth > limit + 1e-9 * scale] > limit).all()


def test_random_triangles() -> None:
    random = np.random.default_rng(1)
    for _ in range(1500):
        p, q = random.normal(size=(2, 3)) * 10.0 ** random.uniform(-2, 2, (2, 1))
        check(p, q, random.normal(size=(LANES, 3, 3)) * 10.0 ** random.uniform(-2, 2, (LANES, 1, 1)))


def test_near_degenerate_triangles() -> None:
    """On a coarse grid with tiny nudges parallel, touching, crossing, collinear and coinciding cases abound."""
    random = np.random.default_rng(2)
    for _ in range(4000):
        grid = random.integers(-3, 4, (2 + 3 * LANES, 3)) + random.choice(_TINY, (2 + 3 * LANES, 3))
        p, q = grid[:2]
        check(p, q if random.uniform() < 0.8 else p, grid[2:].reshape(LANES, 3, 3))


@pytest.mark.parametrize("width", [0.0, 1e-14, 1e-10, 1e-8, 1e-6, 1e-4])
def test_needles(width: float) -> None:
    """Triangles thin as a needle and segments almost along them, crossing and beside; exact arithmetic judges."""
    random = np.random.default_rng(3)
    for _ in range(6):
        a, along, across, up = random.normal(size=(4, 3))
        share = random.uniform(size=(LANES, 1))
        triangles = np.stack([a + 0 * share, a + along + 0 * share, a + share * along + width * across], axis=1)
        p = a + random.uniform(-0.2, 1.2) * along + random.choice([0.0, 0.3, 1.0]) * width * across - width * up
        q = p + random.choice([0.0, 1.0]) * along + 2 * width * up
        distance = measured(p, q, triangles)[0]
        truth = [exact_distance(p, q, triangle) for triangle in triangles]
        assert distance == pytest.approx(np.array(truth), abs=1e-8)


def awkward(random: np.random.Generator, turn: int) -> tuple[np.ndarray, float]:
    """Triangles (16 or 48, 3, 3) that bounds have a hard time with, and their size in mm."""
    size, count = 10.0 ** random.uniform(-1, 3), LANES if turn % 4 else 3 * LANES
    sizes = 10.0 ** random.uniform(-4 * (turn % 2), 0, (count, 1, 1))
    triangles = random.normal(size=(count, 3, 3)) * size * sizes
    kind = turn % 7
    if kind in (0, 1):  # needles
        triangles[:, 2] = triangles[:, 0] + 1e-6 * triangles[:, 2]
    elif kind == 2:  # points, and all of them in one place
        triangles[:] = triangles[0, 0] if turn % 2 else triangles[:, :1]
    elif kind == 3:  # small ones about one that is huge
        triangles[1:] *= 1e-5
    elif kind == 4:  # a flat block
        triangles[..., turn % 3] = 0.0
    elif kind == 5:  # one triangle, sixteen times over
        triangles[:] = triangles[0]
    return triangles + random.normal(size=3) * 10.0 ** random.uniform(-1, 6 if turn % 5 == 0 else 4), size


def test_single_precision_never_leaves_a_triangle_out() -> None:
    """HAZ-08: bounds by rounded triangles hold for needles, huge ones, flat blocks, points and far from the origin."""
    random = np.random.default_rng(6)
    probe, gaps = np.empty(PROBE, np.float32), np.empty(LANES, np.float32)
    for turn in range(3000):
        triangles, size = awkward(random, turn)
        a, b, c = triangles[random.integers(len(triangles))]
        along = random.normal() * (b - a) + random.normal() * (c - a)
        over = random.normal(size=3) * size * 10.0 ** random.uniform(-6, 0)  # just over a triangle, along its plane
        p, q = (a + b + c) / 3.0 + over - along, (a + b + c) / 3.0 + over + 10.0 ** random.uniform(-2, 1) * along
        wide = build_bvh16(triangles.reshape(-1, 3), np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3))
        describe_single(p, q - p, wide.frame, probe)
        for facets, label in zip(wide.facets.reshape(-1, FACETS), wide.label.reshape(-1, LANES), strict=True):
            truth = every_distance(p, q, triangles[label])
            for limit in (0.0, float(np.median(truth))):
                over_it = facet_gaps(facets, probe, np.float32(limit), gaps)
                assert over_it == (gaps > np.float32(limit)).sum()
                assert (gaps <= truth).all()
            low, high = facet_bounds(facets, probe)
            assert low <= truth.min() <= high
