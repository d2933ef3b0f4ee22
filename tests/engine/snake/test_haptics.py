"""Forces on the hand: direction, monotony, caps, and no NaN from anything finite (Kwok 2013, eq. 31-35)."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError
from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.query.query import Query
from vfix_engine.robots import SnakeModel
from vfix_engine.snake.haptics.haptics import HapticSettings, step_forces

TABLE_II = HapticSettings()
STILL = np.zeros(2)
any_number = st.floats(allow_nan=False, allow_infinity=False)
pairs = st.tuples(any_number, any_number)


def resistance(q_speed: ArrayLike, torque: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike) -> np.ndarray:
    """F_r of a step in which no link deviates."""
    motion = (np.array(values, dtype=float) for values in (q_speed, torque, velocity, acceleration))
    return step_forces(*motion, np.zeros(5), np.zeros(2), TABLE_II)[0]


def guidance(depth: ArrayLike, outwards: ArrayLike, settings: HapticSettings = TABLE_II) -> np.ndarray:
    """F_h of a step at rest."""
    still = np.zeros(10), np.zeros(10), STILL, STILL
    return step_forces(*still, np.array(depth, dtype=float), np.array(outwards, dtype=float), settings)[1]


def damping(speed: float) -> float:
    """N, against a camera that moves to the right with the fastest joint at ``speed`` rad/s."""
    return -float(resistance([0.0, speed, 0.1 * speed], np.zeros(3), (5.0, 0.0), STILL)[0])


def inertia(torque: float) -> float:
    return -float(resistance(np.zeros(3), [0.2 * torque, 0.0, torque], STILL, (0.0, 7.0))[1])


def test_resistance_is_the_printed_curve() -> None:
    """(31) with the exponents that the print lost, at values of Table II."""
    for speed in (0.1, -0.3, 0.6):
        b = math.radians(36.0) - abs(speed)
        assert damping(speed) == pytest.approx(1e-3 * (1.0 / b - 1.0 / math.radians(36.0)), rel=1e-12)
    for torque in (0.01, -0.05, 0.07):
        margin = 0.0756 - abs(torque)
        assert inertia(torque) == pytest.approx(3e-3 * (1.0 / margin - 1.0 / 0.0756), rel=1e-12)


def test_resistance_rises_from_nothing_to_its_cap_without_a_jump() -> None:
    for force, limit, cap, constant in (
        (damping, math.radians(36.0), 0.88, 1e-3),
        (inertia, 0.0756, 3.30, 3e-3),
    ):
        knee = limit - 1.0 / (cap / constant + 1.0 / limit)  # where the curve meets its cap
        used = np.concatenate([np.linspace(0.0, knee, 400), np.linspace(knee, 3.0 * limit, 50)[1:]])
        forces = np.array([force(float(u)) for u in used])
        assert forces[0] == 0.0
        assert (np.diff(forces[:400]) > 0.0).all()
        assert forces[399] == pytest.approx(cap, rel=1e-9)
        np.testing.assert_array_equal(forces[400:], cap)  # at the limit and beyond it too
        assert force(knee * (1.0 - 1e-9)) == pytest.approx(cap, abs=1e-5)


def test_resistance_opposes_the_camera() -> None:
    """(32) with the sign that the print lost: damping against the velocity, inertia against the acceleration."""
    random = np.random.default_rng(0)
    for _ in range(200):
        speeds, torques = random.uniform(-0.7, 0.7, 10), random.uniform(-0.08, 0.08, 10)
        velocity, acceleration = random.normal(size=2), random.normal(size=2)
        slow = resistance(speeds, np.zeros(10), velocity, acceleration)
        assert slow @ velocity == pytest.approx(-np.linalg.norm(slow) * np.linalg.norm(velocity))
        heavy = resistance(np.zeros(10), torques, velocity, acceleration)
        assert heavy @ acceleration == pytest.approx(-np.linalg.norm(heavy) * np.linalg.norm(acceleration))
        both = resistance(speeds, torques, velocity, acceleration)
        np.testing.assert_allclose(both, slow + heavy, atol=1e-12)


def test_a_camera_at_rest_is_not_held() -> None:
    """(32) is 0/0 there."""
    beyond = np.full(4, 10.0)
    assert not resistance(beyond, beyond, STILL, STILL).any()
    assert not resistance(beyond, beyond, (6e-10, -6e-10), (0.0, 9e-10)).any()
    held = resistance(beyond, beyond, (0.0, 1e-6), STILL)
    np.testing.assert_allclose(held, [0.0, -0.88])


def test_guidance_is_the_sum_of_springs_towards_less_bending() -> None:
    """(33)-(35): strength from the links, direction J [−1, 0]ᵀ, the first column of J."""
    outwards = np.array([30.0, 40.0])
    force = guidance([0.0, 1.0, 2.0, 0.5, 3.0], outwards)
    strength = 0.07 * 3.5 + 0.45 * 3.0
    np.testing.assert_allclose(force, [-0.6 * strength, -0.8 * strength], rtol=1e-12)
    assert not guidance(np.zeros(5), outwards).any()
    np.testing.assert_allclose(np.linalg.norm(guidance(np.full(5, 1e3), outwards)), 3.3, rtol=1e-12)
    assert not guidance(np.full(5, 4.0), STILL).any()


def test_thresholds_put_off_the_springs() -> None:
    late = HapticSettings(threshold=(2.0, 2.0, 2.0, 2.0, 1.0))
    outwards = (-1.0, 0.0)
    assert not guidance([2.0, 1.9, 0.0, 2.0, 1.0], outwards, late).any()
    np.testing.assert_allclose(guidance([2.5, 0.0, 0.0, 0.0, 1.2], outwards, late), [0.5 * 0.07 + 0.2 * 0.45, 0.0])
    before, after = (guidance([2.0 + d, 0.0, 0.0, 0.0, 0.0], outwards, late)[0] for d in (-1e-9, 1e-9))
    assert abs(after - before) < 1e-9


@given(
    st.lists(st.tuples(any_number, any_number), min_size=1, max_size=10), pairs, pairs,
    st.lists(any_number, min_size=5, max_size=5), pairs,
)  # fmt: skip
@settings(max_examples=200, deadline=None)
def test_every_finite_input_makes_a_finite_and_bounded_force(
    joints: list[tuple[float, float]],
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
    depth: list[float],
    outwards: tuple[float, float],
) -> None:
    speeds, torques = np.array(joints).T
    given_ = (np.array(values) for values in (velocity, acceleration, depth, outwards))
    holding, leading = step_forces(speeds, torques, *given_, TABLE_II)
    assert np.isfinite([holding, leading]).all()
    assert math.hypot(*holding) <= (0.88 + 3.30) * (1.0 + 1e-12)
    assert math.hypot(*leading) <= 3.3 * (1.0 + 1e-12)
    assert math.hypot(*(holding + leading)) <= TABLE_II.most * (1.0 + 1e-12)


def test_another_number_of_links_keeps_the_tips_spring() -> None:
    settings = TABLE_II.for_links(3)
    assert settings.spring == (0.07, 0.07, 0.45)
    assert settings.threshold == (0.0, 0.0, 0.0)
    assert TABLE_II.for_links(5) == TABLE_II
    assert TABLE_II.for_links(1).spring == (0.45,)
    assert TABLE_II.for_links(7).spring == (0.07,) * 6 + (0.45,)
    own = HapticSettings(spring=(0.1, 0.2, 0.3), threshold=(1.0, 2.0, 3.0))
    assert (own.for_links(2).spring, own.for_links(2).threshold) == ((0.2, 0.3), (2.0, 3.0))
    assert own.for_links(4).spring == (0.1, 0.1, 0.2, 0.3)
    with pytest.raises(InputError, match="at least 1"):
        TABLE_II.for_links(0)


@pytest.mark.parametrize(
    "wrong",
    [{"tau_max": 0.0}, {"speed_max": math.nan}, {"f_h_max": math.inf}, {"c_b": -1.0}, {"spring": ()},
     {"spring": (0.07, -0.1, 0.0, 0.0, 0.0)}, {"threshold": (0.0,)}, {"threshold": (math.nan,) * 5}],
)  # fmt: skip
def test_settings_that_are_none_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        HapticSettings(**wrong)  # type: ignore[arg-type]


class BentInACavity:
    """Five links in the cavity, base inclined by 25°, all bent alike: by 40° r a link towards ϑ."""

    def __init__(self) -> None:
        self.snake = SnakeModel(5)
        self.query, self.packed = Query(self.snake.vertices(200)), body_cavity().packed()
        self.base = np.eye(4)
        self.base[:3, :3] = Rotation.from_euler("y", 25.0, degrees=True).as_matrix()
        self.base[:3, 3] = (0.0, 0.0, 40.0)

    def joints(self, r: float, theta: float) -> np.ndarray:
        return math.radians(40.0) * r * np.tile([-math.sin(theta), math.cos(theta)], 5)

    def depth(self, r: float, theta: float) -> np.ndarray:
        frames = self.snake.frames(self.joints(r, theta), self.base)
        return self.query.deviations(self.packed, frames, (0, len(self.packed.rows))).depth

    def jacobian(self, r: float, theta: float) -> np.ndarray:
        """(28)"""
        q = self.joints(r, theta)
        partials = np.column_stack([self.joints(1.0, theta), self.joints(r, theta + math.pi / 2)])
        camera = self.snake.point_jacobian(q, self.base, 4, [0.0, 0.0, self.snake.camera_offset_mm])
        return (self.snake.camera(q, self.base)[:3, :3].T @ camera @ partials)[:2]


def test_a_hand_that_gives_way_is_led_back_into_the_cavity() -> None:
    """A hand that follows the force by 2 mm at a time: the springs slacken with every step, until there is none."""
    robot, led = BentInACavity(), 0
    for theta in np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False):
        state = np.array([0.4, float(theta)])
        depth = robot.depth(*state)
        for _ in range(60):
            jacobian = robot.jacobian(*state)
            force = guidance(depth, jacobian[:, 0])
            if not force.any():
                break
            led += 1
            state += np.linalg.solve(jacobian, 2.0 * force / np.linalg.norm(force))
            before, depth = depth, robot.depth(*state)
            assert np.dot(TABLE_II.spring, depth) < np.dot(TABLE_II.spring, before)
        assert not depth.any()
    assert led > 100  # there was something to lead back from


def test_less_bending_is_not_always_less_deviation() -> None:
    """A limit of (34) as it is printed: an end that is bent back towards the base goes out first when it is unbent."""
    robot, state = BentInACavity(), np.array([0.9, 0.0])
    depth, jacobian = robot.depth(*state), robot.jacobian(*state)
    force = guidance(depth, jacobian[:, 0])
    after = robot.depth(*(state + np.linalg.solve(jacobian, force / np.linalg.norm(force))))
    assert np.dot(TABLE_II.spring, after) > np.dot(TABLE_II.spring, depth) > 0.0
