"""The admittance law: on the path, off it, and with hands that push outwards."""

import numpy as np
import pytest

from vfix_engine.control.admittance import approach_velocity, path_velocity, saturate

LAW = {"gain": 2.0, "k_d": 0.2, "k_tau": 0.0, "capture": 0.05}
TANGENT = np.array([0.0, 1.0, 0.0])


def test_on_the_path_only_the_force_along_it_counts() -> None:
    velocity = path_velocity(np.array([3.0, 4.0, -1.0]), TANGENT, np.zeros(3), **LAW)
    np.testing.assert_allclose(velocity, [0.0, 8.0, 0.0], atol=1e-12)


def test_backwards_is_along_the_path_as_well() -> None:
    velocity = path_velocity(np.array([0.0, -4.0, 1.0]), TANGENT, np.zeros(3), **LAW)
    np.testing.assert_allclose(velocity, [0.0, -8.0, 0.0], atol=1e-12)


def test_no_force_is_no_motion_however_far_the_tip_is_off() -> None:
    assert not any(path_velocity(np.zeros(3), TANGENT, np.array([5.0, 0.0, 0.0]), **LAW))


@pytest.mark.parametrize("offset", [1e-6, 0.001, 0.02, 0.05, 0.3, 2.0, 50.0])
def test_no_force_ever_moves_the_tip_further_off_the_path(offset: float) -> None:
    """The printed law loses the sign of D_c: outward forces moved the tool away from the path."""
    random = np.random.default_rng(3)
    forces = random.normal(size=(2000, 3))
    for force in forces:
        towards = offset * np.array([1.0, 0.0, 0.0])
        velocity = np.array(path_velocity(force, TANGENT, towards, **LAW))
        assert velocity @ towards >= -1e-12
        assert velocity @ force >= -1e-12  # and the robot never works against the hand


def test_straight_outward_force_moves_nothing() -> None:
    velocity = path_velocity(np.array([-4.0, 0.0, 0.0]), TANGENT, np.array([0.01, 0.0, 0.0]), **LAW)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-12)


def test_correction_is_a_blend_that_saturates() -> None:
    force = np.array([0.0, 5.0, 0.0])
    near = path_velocity(force, TANGENT, np.array([0.05, 0.0, 0.0]), **LAW)
    far = path_velocity(force, TANGENT, np.array([9.0, 0.0, 0.0]), **LAW)
    np.testing.assert_allclose(near, far)
    assert near[0] / near[1] == pytest.approx(0.2 / 0.8)


def test_compliance_yields_across_the_path() -> None:
    force = np.array([3.0, 4.0, 0.0])
    velocity = path_velocity(force, TANGENT, np.zeros(3), **{**LAW, "k_tau": 1.0})
    np.testing.assert_allclose(velocity, 2.0 * force)


def test_speed_at_the_force_cap_is_about_ten_millimetres_per_second() -> None:
    velocity = path_velocity(np.array([0.0, 5.0, 0.0]), TANGENT, np.zeros(3), **LAW)
    assert np.linalg.norm(velocity) == pytest.approx(10.0)


def test_approach_goes_straight_at_the_hands_speed() -> None:
    towards = np.array([0.0, 0.0, -4.0])
    np.testing.assert_allclose(approach_velocity(np.array([3.0, 0.0, 0.0]), towards, gain=2.0), [0, 0, -6.0])
    assert not any(approach_velocity(np.zeros(3), towards, gain=2.0))
    assert not any(approach_velocity(np.ones(3), np.zeros(3), gain=2.0))


def test_saturation_keeps_the_direction() -> None:
    np.testing.assert_allclose(saturate(np.array([0.0, 30.0, 40.0]), 5.0), [0.0, 3.0, 4.0])
    np.testing.assert_allclose(saturate(np.array([0.1, 0.0, 0.0]), 5.0), [0.1, 0.0, 0.0])
