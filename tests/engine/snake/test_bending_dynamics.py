"""Torques of a snake that is steered over its polar Hermite surface while tissue moves that (Kwok 2013, eq. 30)."""

import math

import numpy as np
import pinocchio as pin
import pytest

from vfix_engine.robots import SnakeModel
from vfix_engine.robots.snake_dynamics import Drift, SnakeDynamics, accelerated
from vfix_engine.snake.bending.hermite import PolarHermite

SNAKE = SnakeModel(5)
STEP = 1e-4  # [s]
KNOTS = np.array([0.0, 1.4, 3.0, 4.9])


class Moving:
    """Steering by known functions of the time over a surface that becomes another one in 2 s."""

    def __init__(self) -> None:
        random = np.random.default_rng(7)
        self.now, self.then = (
            PolarHermite(random.uniform(-0.2, 0.2, 10), KNOTS, random.uniform(-0.7, 0.7, (4, 10))) for _ in range(2)
        )

    def steering(self, t: float) -> tuple[float, float]:
        return 0.7 + 0.5 * math.sin(3.0 * t), 0.3 + 2.5 * t

    def joints(self, t: float) -> np.ndarray:
        place, share = self.steering(t), 0.5 * t
        return (1.0 - share) * self.now.value(*place) + share * self.then.value(*place)

    def motion(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """q̇ and q̈ by (30)."""
        place, share = self.steering(t), 0.5 * t
        partials, second = (
            (1.0 - share) * one + share * other
            for one, other in (
                (self.now.partials(*place), self.then.partials(*place)),
                (self.now.second(*place), self.then.second(*place)),
            )
        )
        drift = Drift(
            0.5 * (self.then.value(*place) - self.now.value(*place)),
            np.zeros(10),
            0.5 * (self.then.partials(*place) - self.now.partials(*place)),
        )
        rate, more = (1.5 * math.cos(3.0 * t), 2.5), (-4.5 * math.sin(3.0 * t), 0.0)
        return accelerated(partials, second, rate, more, drift)


def times() -> np.ndarray:
    """Where the surface has its second derivatives: not at a control angle, and r not just at 1."""
    t = np.linspace(0.01, 1.9, 40)
    theta, r = (0.3 + 2.5 * t) % (2.0 * math.pi), 0.7 + 0.5 * np.sin(3.0 * t)
    away = np.abs(theta[:, None] - np.append(KNOTS, 2.0 * math.pi)).min(axis=1)
    return t[(away > 0.01) & (np.abs(r - 1.0) > 0.01)]


def test_joint_motion_is_that_of_the_trajectory() -> None:
    moving = Moving()
    assert len(times()) > 30
    for t in times():
        velocity, acceleration = moving.motion(t)
        behind, here, ahead = (moving.joints(t + d) for d in (-STEP, 0.0, STEP))
        np.testing.assert_allclose(velocity, (ahead - behind) / (2.0 * STEP), rtol=0.0, atol=1e-5)
        np.testing.assert_allclose(acceleration, (ahead - 2.0 * here + behind) / STEP**2, rtol=0.0, atol=1e-5)


def test_the_motors_give_the_energy_that_the_links_take_up() -> None:
    """τ·q̇ of (30) and Newton-Euler against the total energy along the trajectory."""
    moving, dynamics = Moving(), SnakeDynamics(SNAKE)
    data = dynamics.model.createData()

    def energy(t: float) -> float:
        q, velocity = moving.joints(t), moving.motion(t)[0]
        kinetic = pin.computeKineticEnergy(dynamics.model, data, q, velocity)
        return float(kinetic + pin.computePotentialEnergy(dynamics.model, data, q))

    powers = []
    for t in times():
        velocity, acceleration = moving.motion(t)
        powers.append(float(dynamics.torque(moving.joints(t), velocity, acceleration) @ velocity))
        assert powers[-1] == pytest.approx((energy(t + STEP) - energy(t - STEP)) / (2.0 * STEP), rel=1e-5, abs=1e-7)
    assert max(powers) > 0.01 > -0.01 > min(powers)  # [W]
