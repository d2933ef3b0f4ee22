"""The handle: spring, cap, interpolation, heartbeat and decay (HAZ-05, HAZ-11)."""

import numpy as np
import pytest

from vfix_engine.simulation.handle import Handle

TOOL = np.zeros(3)
SPRING = {"stiffness": 0.25, "cap": 5.0}


def settled(grip: np.ndarray) -> Handle:
    handle = Handle()
    handle.press(grip, 10.0)
    return handle


def test_spring_and_cap() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    np.testing.assert_allclose(handle.force(TOOL, now=10.06, **SPRING), [2.0, 0.0, 0.0])
    handle = settled(np.array([0.0, 90.0, 0.0]))
    np.testing.assert_allclose(handle.force(TOOL, now=10.06, **SPRING), [0.0, 5.0, 0.0])


def test_between_two_drag_events_the_grip_moves_evenly() -> None:
    handle = settled(np.array([0.0, 0.0, 0.0]))
    handle.press(np.array([0.0, 0.0, 0.0]), 10.06)
    handle.press(np.array([4.0, 0.0, 0.0]), 10.1)
    forces = [handle.force(TOOL, now=10.1 + t, **SPRING)[0] for t in (0.0, 0.0125, 0.025, 0.05)]
    np.testing.assert_allclose(forces, [0.0, 0.25, 0.5, 1.0], atol=1e-9)


def test_a_still_hand_pushes_as_long_as_it_is_heard_of() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    for i in range(250):
        now = 10.0 + 0.04 * (i + 1)
        handle.beat(now)
        np.testing.assert_allclose(handle.force(TOOL, now=now + 0.03, **SPRING), [2.0, 0.0, 0.0])


def test_without_heartbeat_the_force_is_gone_in_a_tenth_of_a_second() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    fading = [np.linalg.norm(handle.force(TOOL, now=10.0 + t, **SPRING)) for t in (0.06, 0.07, 0.085, 0.099)]
    assert fading == sorted(fading, reverse=True)
    assert fading[-1] < 0.1
    assert not handle.force(TOOL, now=10.1, **SPRING).any()


@pytest.mark.parametrize("late", [0.1, 0.15, 60.0])
def test_a_late_beat_brings_no_lost_hand_back(late: float) -> None:
    """HAZ-11: nobody asked for a force in between, as while the rehearsal is paused; only a press takes hold again."""
    grip = np.array([8.0, 0.0, 0.0])
    handle = settled(grip)
    lost = 10.0 + late
    for beats in range(10):
        handle.beat(lost + 0.04 * beats)
        assert not handle.active(lost + 0.04 * beats)
        assert not handle.force(TOOL, now=lost + 0.04 * beats + 0.02, **SPRING).any()
    back = lost + 0.5
    handle.press(grip, back)
    rising = [handle.force(TOOL, now=back + t, **SPRING)[0] for t in (0.0, 0.015, 0.03, 0.06)]
    np.testing.assert_allclose(rising, [0.0, 0.5, 1.0, 2.0], atol=1e-9)


def test_a_beat_that_is_late_but_in_time_lets_the_force_rise_again_without_a_jump() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    faded = handle.force(TOOL, now=10.09, **SPRING)
    assert 0.0 < faded[0] < 1.0
    handle.beat(10.09)
    np.testing.assert_allclose(handle.force(TOOL, now=10.09, **SPRING), faded)
    np.testing.assert_allclose(handle.force(TOOL, now=10.14, **SPRING), [2.0, 0.0, 0.0])


def test_release_fades_within_a_tenth_of_a_second() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    handle.release(10.05)
    handle.beat(10.06)
    assert 0 < np.linalg.norm(handle.force(TOOL, now=10.07, **SPRING)) < 2.0
    assert not handle.force(TOOL, now=10.15, **SPRING).any()
    assert not handle.active(10.16)


@pytest.mark.parametrize("grip", [[np.nan, 0, 0], [np.inf, 0, 0], [1e6, 0, 0]])
def test_nonsense_pulls_nothing(grip: list[float]) -> None:
    handle = Handle()
    handle.press(np.array(grip), 1.0)
    assert not handle.force(TOOL, now=1.05, **SPRING).any()
