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
    np.testing.assert_allclose(handle.force(TOOL, now=10.05, **SPRING), [2.0, 0.0, 0.0])
    handle = settled(np.array([0.0, 90.0, 0.0]))
    np.testing.assert_allclose(handle.force(TOOL, now=10.05, **SPRING), [0.0, 5.0, 0.0])


def test_between_two_drag_events_the_grip_moves_evenly() -> None:
    handle = settled(np.array([0.0, 0.0, 0.0]))
    handle.press(np.array([4.0, 0.0, 0.0]), 10.05)
    forces = [handle.force(TOOL, now=10.05 + t, **SPRING)[0] for t in (0.0, 0.0125, 0.025, 0.05)]
    np.testing.assert_allclose(forces, [0.0, 0.25, 0.5, 1.0], atol=1e-9)


def test_a_still_hand_pushes_as_long_as_it_is_heard_of() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    for i in range(250):
        now = 10.0 + 0.04 * (i + 1)
        handle.beat(now)
        np.testing.assert_allclose(handle.force(TOOL, now=now + 0.03, **SPRING), [2.0, 0.0, 0.0])


def test_without_heartbeat_the_force_is_gone_in_a_tenth_of_a_second() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    fading = [np.linalg.norm(handle.force(TOOL, now=10.0 + t, **SPRING)) for t in (0.055, 0.07, 0.085, 0.099)]
    assert fading == sorted(fading, reverse=True)
    assert fading[-1] < 0.1
    assert not handle.force(TOOL, now=10.1, **SPRING).any()
    handle.beat(10.2)  # a late heartbeat does not bring a lost hand back
    assert not handle.force(TOOL, now=10.2, **SPRING).any()


def test_release_fades_within_a_tenth_of_a_second() -> None:
    handle = settled(np.array([8.0, 0.0, 0.0]))
    handle.release(10.02)
    handle.beat(10.05)
    assert 0 < np.linalg.norm(handle.force(TOOL, now=10.06, **SPRING)) < 2.0
    assert not handle.force(TOOL, now=10.12, **SPRING).any()
    assert not handle.active(10.13)


@pytest.mark.parametrize("grip", [[np.nan, 0, 0], [np.inf, 0, 0], [1e6, 0, 0]])
def test_nonsense_pulls_nothing(grip: list[float]) -> None:
    handle = Handle()
    handle.press(np.array(grip), 1.0)
    assert not handle.force(TOOL, now=1.05, **SPRING).any()
