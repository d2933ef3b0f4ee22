"""The snake's inverse dynamics against Lagrange's equations and energy."""

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.errors import RobotError
from vfix_engine.robots import SnakeModel
from vfix_engine.robots.snake import JOINT_TORQUE
from vfix_engine.robots.snake_dynamics import GRAVITY, SnakeDynamics, gravity_in

Array = np.ndarray
GRAVITIES = [(0.0, 0.0, -GRAVITY), (3.0, -8.0, 4.0)]


@pytest.mark.parametrize("links", [1, 5, 30])
def test_the_model_stands_where_the_snake_does(links: int) -> None:
    """Pinocchio's model in metres, our frames in mm."""
    snake = SnakeModel(links)
    dynamics = SnakeDynamics(snake)
    model, data = dynamics.model, dynamics.model.createData()
    assert model.nq == model.nv == snake.dof
    random = np.random.default_rng(links)
    for _ in range(20):
        q = random.uniform(-snake.q_max, snake.q_max, snake.dof)
        pin.framesForwardKinematics(model, data, q)
        for i, frame in enumerate(snake.frames(q, np.eye(4))):
            place = data.oMf[model.getFrameId(f"link{i}" if i else "base")]
            np.testing.assert_allclose(1e-3 * frame[:3, 3], place.translation, rtol=0.0, atol=1e-12)
            np.testing.assert_allclose(frame[:3, :3], place.rotation, rtol=0.0, atol=1e-12)
    assert np.allclose(model.upperPositionLimit, snake.q_max)
    assert np.allclose(model.effortLimit, 0.0756)
    assert sum(body.mass for body in model.inertias) == pytest.approx(snake.mass_kg * links)


def energies(snake: SnakeModel, q: Array, velocity: Array, gravity: Array) -> tuple[float, float]:
    """Kinetic and potential energy in J by products of rotations and angular velocities added up link by link."""
    length, radius, mass = 1e-3 * snake.length_mm, 1e-3 * snake.radius_mm, snake.mass_kg
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    own = np.diag([across, across, 0.5 * mass * radius**2])  # solid cylinder along z
    turn, end, spin, speed = Rotation.identity(), np.zeros(3), np.zeros(3), np.zeros(3)
    kinetic = potential = 0.0
    for link in range(snake.links):
        odd, even = q[2 * link : 2 * link + 2]
        spin = spin + turn.apply([velocity[2 * link], 0.0, 0.0])
        turn = turn * Rotation.from_euler("x", odd)
        spin = spin + turn.apply([0.0, velocity[2 * link + 1], 0.0])
        turn = turn * Rotation.from_euler("y", even)
        lever = turn.apply([0.0, 0.0, length])
        middle, drift = end + 0.5 * lever, speed + np.cross(spin, 0.5 * lever)
        inertia = turn.as_matrix() @ own @ turn.as_matrix().T
        kinetic += 0.5 * (mass * drift @ drift + spin @ inertia @ spin)
        potential -= mass * gravity @ middle
        end, speed = end + lever, speed + np.cross(spin, lever)
    return kinetic, potential


def slope(function: Callable[[Array], float], at: Array, step: float) -> Array:
    return np.array([(function(at + e) - function(at - e)) / (2.0 * step) for e in step * np.eye(len(at))])


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_torques_are_lagranges(gravity: tuple[float, float, float]) -> None:
    """τ = d/dt ∂T/∂q̇ − ∂T/∂q + ∂V/∂q of two links, with energies that know nothing of Pinocchio."""
    snake = SnakeModel(2, 40.0, radius_mm=10.0, mass_kg=0.2)
    dynamics, down = SnakeDynamics(snake), np.array(gravity)
    random = np.random.default_rng(3)
    for _ in range(6):
        q, velocity, acceleration = (random.uniform(-size, size, 4) for size in (0.7, 3.0, 20.0))

        def momentum(time: float, q: Array = q, velocity: Array = velocity, more: Array = acceleration) -> Array:
            """∂T/∂q̇ on the trajectory with this place, speed and acceleration at time 0; T is a quadratic in q̇."""
            place, speed = q + velocity * time + 0.5 * more * time**2, velocity + more * time
            return slope(lambda v: energies(snake, place, v, down)[0], speed, 1.0)

        step = 1e-4
        rate = (momentum(step) - momentum(-step)) / (2.0 * step)
        wanted = rate - slope(
            lambda x, v=velocity: energies(snake, x, v, down)[0] - energies(snake, x, v, down)[1], q, 1e-5
        )
        torque = dynamics.torque(q, velocity, acceleration, gravity)
        np.testing.assert_allclose(torque, wanted, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_power_is_the_rate_of_energy(gravity: tuple[float, float, float]) -> None:
    """τ·q̇ = d/dt (T + V) of five links along a smooth motion."""
    snake = SnakeModel(5)
    dynamics, down = SnakeDynamics(snake), np.array(gravity)
    random = np.random.default_rng(4)
    size, pace, phase = random.uniform(0.1, 0.7, 10), random.uniform(1.0, 6.0, 10), random.uniform(0.0, 6.0, 10)

    def energy(time: float) -> float:
        angle = pace * time + phase
        return sum(energies(snake, size * np.sin(angle), size * pace * np.cos(angle), down))

    step = 1e-4
    for time in np.linspace(0.0, 2.0, 9):
        angle = pace * time + phase
        q, velocity = size * np.sin(angle), size * pace * np.cos(angle)
        torque = dynamics.torque(q, velocity, -pace * velocity * np.tan(angle), gravity)
        power = (energy(time + step) - energy(time - step)) / (2.0 * step)
        assert torque @ velocity == pytest.approx(power, rel=1e-6, abs=1e-8)


def test_an_upright_snake_needs_no_torque_and_one_that_lies_its_weight() -> None:
    dynamics, none = SnakeDynamics(SnakeModel(5)), np.zeros(10)
    assert not dynamics.torque(none, none, none).any()
    lying = dynamics.torque(none, none, none, (0.0, -GRAVITY, 0.0))
    # About x: link i's weight half a link beyond its joint, and all those ahead of it. Weight pulls to −y, a positive
    # angle takes the tip to −y, so the torque that holds it is negative.
    for link in range(5):
        ahead = sum(0.015 * GRAVITY * 0.028 * (k - link + 0.5) for k in range(link, 5))
        assert lying[2 * link] == pytest.approx(-ahead, rel=1e-12)
    np.testing.assert_allclose(lying[1::2], 0.0, atol=1e-18)
    assert np.abs(lying).max() == pytest.approx(0.0515, abs=5e-5)  # N·m, and motors of Table II hold it
    assert np.abs(lying).max() < JOINT_TORQUE


def test_gravity_turns_with_the_base() -> None:
    """In LPS a patient on the back has +y to the ground."""
    np.testing.assert_allclose(gravity_in(np.eye(4)), [0.0, GRAVITY, 0.0])
    base = np.eye(4)
    base[:3, :3] = Rotation.from_euler("x", 90.0, degrees=True).as_matrix()
    np.testing.assert_allclose(gravity_in(base), [0.0, 0.0, -GRAVITY], atol=1e-12)
    np.testing.assert_allclose(gravity_in(base, (0.0, 0.0, -7.0)), [0.0, -GRAVITY, 0.0], atol=1e-12)
    for down in ((0.0, 0.0, 0.0), (0.0, math.nan, 1.0)):
        with pytest.raises(RobotError, match="gravity"):
            gravity_in(base, down)


def test_a_step_of_control_has_no_weight() -> None:
    snake, random = SnakeModel(3), np.random.default_rng(2)
    q, velocity, acceleration = random.uniform(-0.7, 0.7, (3, snake.dof))
    dynamics = SnakeDynamics(snake)
    heavy, light = dynamics.torque(q, velocity, acceleration), dynamics.weightless_torque(q, velocity, acceleration)
    np.testing.assert_array_equal(light, dynamics.torque(q, velocity, acceleration, (0.0, 0.0, 0.0)))
    assert np.abs(heavy - light).max() > 1e-3  # [N·m]


def test_motions_that_are_none_are_refused() -> None:
    dynamics, good = SnakeDynamics(SnakeModel(2)), np.zeros(4)
    for place, wrong in enumerate((np.zeros(3), [0.0, 0.0, math.nan, 0.0], np.zeros((4, 1)))):
        motion = [good, good, good]
        motion[place] = wrong
        with pytest.raises(RobotError, match=r"joint .* of 2 links: 4 finite numbers"):
            dynamics.torque(*motion)
    with pytest.raises(RobotError, match="gravity: 3 finite"):
        dynamics.torque(good, good, good, (0.0, math.inf, 0.0))
