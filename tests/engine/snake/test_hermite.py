"""The polar Hermite surface: Kwok 2013, eq. 21-23, and every derivative against differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vfix_engine.errors import InputError
from vfix_engine.snake.bending.hermite import PolarHermite

UNEVEN = np.array([0.3, 1.0, 2.4, 3.5, 5.1])
SIDE = 1e-9  # [rad] to either side of an angle


def surface(angles: np.ndarray = UNEVEN, joints: int = 6, seed: int = 3) -> PolarHermite:
    rng = np.random.default_rng(seed)
    return PolarHermite(rng.normal(0.0, 0.2, joints), angles, rng.normal(0.0, 0.5, (len(angles), joints)))


def symmetric() -> PolarHermite:
    """Four bends, those across the rest from each other its mirror images."""
    rng = np.random.default_rng(8)
    rest, x, y = rng.normal(0.0, 0.2, 4), rng.normal(0.0, 0.5, 4), rng.normal(0.0, 0.5, 4)
    return PolarHermite(rest, np.arange(4) * np.pi / 2, [rest + x, rest + y, rest - x, rest - y])


def printed(hermite: PolarHermite, r: float, theta: float) -> np.ndarray:
    """(21)-(23) as matrices times basis functions, with what the print lost put back."""

    def basis(u: float) -> np.ndarray:
        return np.array([2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2])

    def around(angle: float) -> np.ndarray:
        knots = np.concatenate([hermite.angles + 2 * np.pi * turn for turn in (-1, 0, 1)])
        shapes = np.tile(hermite.configurations, (3, 1))
        angle = (angle - hermite.angles[0]) % (2 * np.pi) + hermite.angles[0]
        i = int(np.searchsorted(knots, angle, side="right")) - 1
        width = knots[i + 1] - knots[i]
        one = (shapes[i + 1] - shapes[i - 1]) / (knots[i + 1] - knots[i - 1]) * width
        two = (shapes[i + 2] - shapes[i]) / (knots[i + 2] - knots[i]) * width
        return np.column_stack([shapes[i], one, shapes[i + 1], two]) @ basis((angle - knots[i]) / width)

    here, there, rest = around(theta), around(theta + np.pi), hermite.q_nominal
    return np.column_stack([rest, 0.5 * (here - there), here, here - rest]) @ basis(r)


def test_it_is_the_printed_surface() -> None:
    rng = np.random.default_rng(1)
    for hermite in (surface(), surface(np.arange(8) * np.pi / 4), symmetric()):
        for r, theta in rng.uniform([0.0, -7.0], [1.0, 7.0], (50, 2)):
            np.testing.assert_allclose(hermite.value(r, theta), printed(hermite, r, theta), atol=1e-13)


def test_it_goes_through_rest_and_controls() -> None:
    hermite = surface()
    for angle, shape in zip(hermite.angles, hermite.configurations, strict=True):
        np.testing.assert_allclose(hermite.value(1.0, angle), shape, atol=1e-14)
        np.testing.assert_allclose(hermite.value(1.0, angle + 4 * np.pi), shape, atol=1e-13)
        np.testing.assert_allclose(hermite.value(0.0, angle + 0.1), hermite.q_nominal, atol=1e-15)


@pytest.mark.parametrize("r", [0.0, 0.2, 0.7, 1.0, 1.3, -0.4])
def test_it_is_c1_in_the_angle_all_round(r: float) -> None:
    """Value and slope agree on both sides of every control angle, of those across, and of 2π; the second jumps."""
    hermite = surface()
    for angle in [*hermite.angles, *(hermite.angles + np.pi), 0.0, 2 * np.pi]:
        before, after = angle - SIDE, angle + SIDE
        np.testing.assert_allclose(hermite.value(r, before), hermite.value(r, after), atol=2e-8)
        np.testing.assert_allclose(hermite.partials(r, before), hermite.partials(r, after), atol=2e-7)
    knot = hermite.angles[2]
    jump = hermite.second(1.0, knot + SIDE)[:, 2] - hermite.second(1.0, knot - SIDE)[:, 2]
    assert np.abs(jump).max() > 0.1


def test_it_is_c1_along_every_diameter_and_at_one() -> None:
    hermite = surface()
    for theta in np.linspace(0.0, 2 * np.pi, 17):
        np.testing.assert_allclose(hermite.value(-0.3, theta), hermite.value(0.3, theta + np.pi), atol=1e-14)
        for r in (0.0, 1.0):
            np.testing.assert_allclose(hermite.value(r - SIDE, theta), hermite.value(r + SIDE, theta), atol=2e-8)
            inner, outer = hermite.partials(r - SIDE, theta), hermite.partials(r + SIDE, theta)
            np.testing.assert_allclose(inner, outer, atol=2e-7)


def test_it_is_linear_in_r_where_bends_are_symmetric_and_straight_beyond_one() -> None:
    for hermite, radii in ((symmetric(), (0.25, 0.6, 1.2)), (surface(), (1.1, 1.4))):
        for theta in np.linspace(0.1, 6.0, 9):
            way = hermite.value(1.0, theta) - hermite.q_nominal
            for r in radii:
                np.testing.assert_allclose(hermite.value(r, theta), hermite.q_nominal + r * way, atol=1e-14)


def test_partials_are_those_of_differences() -> None:
    hermite, rng, h = surface(), np.random.default_rng(5), 1e-5
    for r, theta in rng.uniform([-1.4, 0.0], [1.4, 2 * np.pi], (300, 2)):
        if min(abs(r), abs(abs(r) - 1.0)) < 2 * h:
            continue
        gap = np.abs((theta - np.concatenate([UNEVEN, UNEVEN + np.pi]) + np.pi) % (2 * np.pi) - np.pi)
        if gap.min() < 2 * h:
            continue
        by_r = (hermite.value(r + h, theta) - hermite.value(r - h, theta)) / (2 * h)
        by_theta = (hermite.value(r, theta + h) - hermite.value(r, theta - h)) / (2 * h)
        np.testing.assert_allclose(hermite.partials(r, theta), np.column_stack([by_r, by_theta]), atol=2e-9)
        across = (hermite.partials(r + h, theta) - hermite.partials(r - h, theta)) / (2 * h)
        round_ = (hermite.partials(r, theta + h) - hermite.partials(r, theta - h)) / (2 * h)
        expected = np.column_stack([across[:, 0], round_[:, 0], round_[:, 1]])
        np.testing.assert_allclose(hermite.second(r, theta), expected, atol=2e-8)
        np.testing.assert_allclose(across[:, 1], round_[:, 0], atol=2e-8)


def test_cartesian_partials_are_those_of_differences_and_finite_at_rest() -> None:
    hermite, rng, h = surface(), np.random.default_rng(6), 1e-6
    for u, v in rng.uniform(-0.95, 0.95, (100, 2)):
        value, partials = hermite.cartesian(u, v)
        np.testing.assert_allclose(value, hermite.value(math.hypot(u, v), math.atan2(v, u)), atol=1e-14)
        by_u = (hermite.cartesian(u + h, v)[0] - hermite.cartesian(u - h, v)[0]) / (2 * h)
        by_v = (hermite.cartesian(u, v + h)[0] - hermite.cartesian(u, v - h)[0]) / (2 * h)
        np.testing.assert_allclose(partials, np.column_stack([by_u, by_v]), atol=1e-8)
    value, partials = hermite.cartesian(0.0, 0.0)
    np.testing.assert_array_equal(value, hermite.q_nominal)
    slopes = [(hermite.cartesian(h, 0.0)[0] - value) / h, (hermite.cartesian(0.0, h)[0] - value) / h]
    np.testing.assert_allclose(partials.T, slopes, atol=1e-5)
    assert np.isfinite(hermite.cartesian(1e-300, -1e-300)[1]).all()


def test_slopes_at_rest_are_not_linear_in_the_direction() -> None:
    """What the docs say of r = 0: a cone, not a plane."""
    hermite = symmetric()
    slope = hermite.partials(0.0, np.pi / 4)[:, 0]
    plane = hermite.cartesian(0.0, 0.0)[1] @ np.array([np.sqrt(0.5), np.sqrt(0.5)])
    assert np.abs(slope - plane).max() > 0.01


@pytest.mark.parametrize(
    "change",
    [
        {"angles": [0.0, 1.0]},
        {"angles": [0.0, 2.0, 1.0]},
        {"angles": [0.0, 1.0, 2 * np.pi]},
        {"angles": [0.0, 1.0, np.nan]},
        {"configurations": np.zeros((3, 4))},
        {"configurations": np.full((3, 2), np.inf)},
        {"r_max": 0.9},
    ],
)
def test_what_is_no_surface_is_refused(change: dict) -> None:
    given = {"q_nominal": [0.0, 0.0], "angles": [0.0, 2.0, 4.0], "configurations": np.zeros((3, 2)), "r_max": 1.4}
    with pytest.raises(InputError):
        PolarHermite(**(given | change))
