"""The camera goes where the hand goes, in its own picture: Kwok 2013, eq. 24-29."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import ArrayLike

from vfix_engine.errors import InputError
from vfix_engine.robots import SnakeModel
from vfix_engine.snake.bending.hermite import PolarHermite
from vfix_engine.snake.bending.visual_motor import BendDirection, VisualMotor

SNAKE = SnakeModel(5)
BASE = np.array([[0.0, 0.0, 1.0, 40.0], [1.0, 0.0, 0.0, -7.0], [0.0, 1.0, 0.0, 120.0], [0.0, 0.0, 0.0, 1.0]])
MICRON = 1e-3  # mm
R_LEAST = 1e-3  # ε⁺ of (29)


def bends(most: float = 0.3, rest: float = 0.0) -> PolarHermite:
    """Four bends towards +x, +y, −x and −y, each its own amount, about a rest that is a little bent itself."""
    q_nominal = rest * np.sin(np.arange(10.0))
    x, y = np.tile([0.0, most], 5), np.tile([-most, 0.0], 5)
    return PolarHermite(q_nominal, np.arange(4) * np.pi / 2, q_nominal + np.array([x, 0.8 * y, -0.9 * x, -1.1 * y]))


def in_picture(motor: VisualMotor, before: BendDirection, after: BendDirection) -> np.ndarray:
    """Motion of the camera (2,) mm along the axes it had before, by the robot's own forward kinematics."""
    start, end = motor.camera(before), motor.camera(after)
    return start[:3, :2].T @ (end[:3, 3] - start[:3, 3])


def step_polar(motor: VisualMotor, r: float, theta: float, wanted: ArrayLike) -> tuple[float, float]:
    """A step as printed: (δr, δϑ) by J⁻¹ (28), r by (29), ϑ in [0, 2π)."""
    dr, dtheta = np.linalg.solve(motor.jacobian(r, theta), wanted)
    theta_next = theta + dtheta + (math.pi if r + dr < 0.0 else 0.0)
    return max(R_LEAST, r + float(dr)), float(theta_next) % (2.0 * math.pi)


def polar(r: float, theta: float) -> BendDirection:
    return BendDirection(r * math.cos(theta), r * math.sin(theta))


def test_jacobians_are_those_of_differences_of_the_camera() -> None:
    motor, rng, h = VisualMotor(SNAKE, bends(rest=0.1), BASE), np.random.default_rng(2), 1e-6
    for r, theta in rng.uniform([0.05, 0.0], [1.3, 2 * np.pi], (40, 2)):
        here = polar(r, theta)
        by_r = (in_picture(motor, here, polar(r + h, theta)) - in_picture(motor, here, polar(r - h, theta))) / (2 * h)
        by_theta = in_picture(motor, here, polar(r, theta + h)) - in_picture(motor, here, polar(r, theta - h))
        np.testing.assert_allclose(motor.jacobian(r, theta), np.column_stack([by_r, by_theta / (2 * h)]), atol=1e-5)
        u, v = here
        by_u = in_picture(motor, here, BendDirection(u + h, v)) - in_picture(motor, here, BendDirection(u - h, v))
        by_v = in_picture(motor, here, BendDirection(u, v + h)) - in_picture(motor, here, BendDirection(u, v - h))
        np.testing.assert_allclose(motor.jacobian_uv(here), np.column_stack([by_u, by_v]) / (2 * h), atol=1e-5)


@pytest.mark.parametrize("state", [(0.0, 0.0), (1e-6, -2e-6), (0.3, -0.2), (-0.7, 0.7), (0.0, 1.2)])
def test_a_micron_to_the_right_is_a_micron_to_the_right(state: tuple[float, float]) -> None:
    """Also through r = 0, where the printed step cannot go."""
    motor, here = VisualMotor(SNAKE, bends(rest=0.1), BASE), BendDirection(*state)
    for wanted in ([MICRON, 0.0], [0.0, MICRON], [-MICRON, 0.0], [0.6 * MICRON, -0.8 * MICRON]):
        moved = in_picture(motor, here, motor.step(here, wanted))
        np.testing.assert_allclose(moved, wanted, atol=1e-5 * MICRON)


def test_the_printed_step_goes_the_same_way_away_from_the_centre() -> None:
    motor = VisualMotor(SNAKE, bends(), BASE)
    for r, theta in ((0.5, 0.4), (0.9, 3.0), (1.1, 5.5)):
        for wanted in ([MICRON, 0.0], [0.0, -MICRON]):
            moved = in_picture(motor, polar(r, theta), polar(*step_polar(motor, r, theta, wanted)))
            np.testing.assert_allclose(moved, wanted, atol=1e-3 * MICRON)


def test_the_printed_step_turns_round_at_the_centre() -> None:
    """(29): r stays at ε⁺ or above, and π is added to the angle where r would become negative."""
    motor = VisualMotor(SNAKE, bends(), BASE)
    r, theta = step_polar(motor, 0.01, 0.0, [-5.0, 0.0])
    assert r == R_LEAST
    assert theta == pytest.approx(math.pi, abs=0.2)
    r, theta = step_polar(motor, R_LEAST, 0.0, [-1e-6, 0.0])
    assert r == R_LEAST
    assert min(theta, 2 * math.pi - theta) < 0.1


def test_straight_at_the_centre_the_printed_step_is_caught_there_and_ours_is_not() -> None:
    """δϑ = 0 and r + δr < 0 give r = ε⁺ and ϑ + π, the camera has not moved, and so on for ever."""
    motor, step = VisualMotor(SNAKE, bends(), BASE), np.array([-0.05, 0.0])
    ours, printed = polar(0.05, 0.0), (0.05, 0.0)
    for _ in range(500):
        ours, printed = motor.step(ours, step), step_polar(motor, *printed, step)
    assert printed[0] < 3 * R_LEAST
    assert ours.u < -0.1


def test_through_the_centre_ours_keeps_to_the_line_and_the_printed_one_does_not() -> None:
    """A straight line that passes the centre at 0.01 of r, 0.05 mm a step, from r = 0.3 to the other side."""
    motor, step = VisualMotor(SNAKE, bends(), BASE), np.array([-0.05, 0.0])
    ours, printed = polar(0.3, 0.03), (0.3, 0.03)
    errors, speeds = np.zeros(2), np.zeros(2)
    for _ in range(1200):
        after, moved = motor.step(ours, step), step_polar(motor, *printed, step)
        for k, (one, two) in enumerate(((ours, after), (polar(*printed), polar(*moved)))):
            errors[k] = max(errors[k], np.linalg.norm(in_picture(motor, one, two) - step))
            speeds[k] = max(speeds[k], np.abs(motor.joints(two) - motor.joints(one)).max())
        ours, printed = after, moved
    assert ours.u < -0.1
    assert errors[0] < 1e-6
    assert errors[1] > 100 * errors[0]
    assert speeds[0] < speeds[1]


def test_what_bends_cannot_do_is_not_forced() -> None:
    """At the rim of the surface, at joint limits and where no bend is, the steering stays finite and within r_max."""
    rng = np.random.default_rng(4)
    flat = PolarHermite(np.zeros(10), np.arange(4) * np.pi / 2, np.zeros((4, 10)))
    for hermite in (bends(), bends(0.9), flat):
        motor, state = VisualMotor(SNAKE, hermite, BASE), BendDirection(0.0, 0.0)
        for wanted in rng.normal(0.0, 5.0, (60, 2)):
            after = motor.step(state, wanted)
            assert math.isfinite(after.r)
            assert after.r <= hermite.r_max + 1e-12
            assert np.linalg.norm(wanted - in_picture(motor, state, after)) <= np.linalg.norm(wanted) + 1e-9
            state = after
    assert state == (0.0, 0.0)


def test_joints_at_their_limits_stay_there() -> None:
    motor = VisualMotor(SNAKE, bends(0.9), BASE)
    assert np.abs(motor.joints(polar(1.2, 0.3))).max() == SNAKE.q_max
    h, r, theta = 1e-6, 1.2, 0.3
    ahead, behind = polar(r + h, theta), polar(r - h, theta)
    by_r = (in_picture(motor, polar(r, theta), ahead) - in_picture(motor, polar(r, theta), behind)) / (2 * h)
    np.testing.assert_allclose(motor.jacobian(r, theta)[:, 0], by_r, atol=1e-5)


def test_what_fits_not_is_refused() -> None:
    with pytest.raises(InputError, match="10 joints for links with 8"):
        VisualMotor(SNAKE.distal(4), bends(), BASE)
    with pytest.raises(InputError, match="transform"):
        VisualMotor(SNAKE, bends(), np.full((4, 4), np.nan))
    motor = VisualMotor(SNAKE, bends(), BASE)
    for wanted in ([np.nan, 0.0], [1.0], [0.0, np.inf]):
        with pytest.raises(InputError, match="finite"):
            motor.step(BendDirection(0.1, 0.1), wanted)


def kinked(seed: int) -> VisualMotor:
    """Eight unlike bends about a rest with joints at their limits: another slope in every direction."""
    rng = np.random.default_rng(seed)
    rest = rng.uniform(-0.3, 0.3, 10)
    rest[rng.choice(10, 4, replace=False)] = SNAKE.q_max * rng.choice([-1.0, 1.0], 4)
    shapes = np.clip(rest + rng.normal(0.0, 0.25, (8, 10)), -SNAKE.q_max, SNAKE.q_max)
    return VisualMotor(SNAKE, PolarHermite(rest, np.arange(8) * np.pi / 4, shapes), BASE)


@pytest.mark.parametrize("size", [0.02, 0.4])
def test_the_hand_gets_away_from_a_kink(size: float) -> None:
    """HAZ-06: a step comes about as near as a fine search of short rays about r = 0."""
    rays = [(r, theta) for r in size * np.geomspace(2e-3, 0.2, 12) for theta in np.arange(0.0, 2.0 * np.pi, 0.1)]
    short = []  # of what that finds, as a share of the wanted motion
    for seed in range(12):
        motor, here = kinked(seed), BendDirection(0.0, 0.0)
        moved = np.array([in_picture(motor, here, polar(*ray)) for ray in rays])
        for angle in np.arange(8) * np.pi / 4:
            wanted = size * np.array([math.cos(angle), math.sin(angle)])
            best = np.linalg.norm(wanted - moved, axis=1).min()
            missing = np.linalg.norm(wanted - in_picture(motor, here, motor.step(here, wanted)))
            short.append((missing - best) / size)
    assert np.quantile(short, 0.95) < 0.1
    assert np.max(short) < 0.4
