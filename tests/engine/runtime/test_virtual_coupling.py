"""The handle: spring, cap, interpolation, heartbeat, rise and decay (HAZ-05, HAZ-11)."""

import numpy as np
import pytest

from vfix_engine.runtime.virtual_coupling import Hold, VirtualCoupling

TOOL = np.zeros(3)
SPRING = {"stiffness": 0.25, "cap": 5.0}
HELD = Hold().press(10.0)


def handle_at(x: float, y: float = 0.0) -> VirtualCoupling:
    handle = VirtualCoupling()
    handle.move(np.array([x, y, 0.0]), 10.0, onwards=False)
    return handle


def test_spring_and_cap() -> None:
    np.testing.assert_allclose(handle_at(8.0).force(TOOL, now=10.0, **SPRING), [2.0, 0.0, 0.0])
    np.testing.assert_allclose(handle_at(0.0, 90.0).force(TOOL, now=10.0, **SPRING), [0.0, 5.0, 0.0])


@pytest.mark.parametrize("grip", [[300.0, 0, 0], [1e6, 0, 0]])
def test_a_place_far_from_the_tool_is_no_pull(grip: list[float]) -> None:
    """HAZ-05."""
    assert not handle_at(*grip[:2]).force(TOOL, now=10.0, **SPRING).any()


def test_between_two_drag_events_the_grip_moves_evenly() -> None:
    handle = handle_at(0.0)
    handle.move(np.array([4.0, 0.0, 0.0]), 10.05, onwards=True)
    forces = [handle.force(TOOL, now=10.05 + t, **SPRING)[0] for t in (0.0, 0.0125, 0.025, 0.05)]
    np.testing.assert_allclose(forces, [0.0, 0.25, 0.5, 1.0], atol=1e-9)
    handle.move(np.array([8.0, 0.0, 0.0]), 11.0, onwards=False)  # another hand begins where it is
    np.testing.assert_allclose(handle.force(TOOL, now=11.0, **SPRING), [2.0, 0.0, 0.0])


def test_nobody_holds_at_first() -> None:
    for now in (0.0, 10.0):
        assert not Hold().active(now)
        assert not Hold().beat(now).active(now)
        assert not Hold().release(now).active(now)


def test_the_force_of_a_hand_that_takes_hold_rises() -> None:
    assert HELD.active(10.0)
    np.testing.assert_allclose([HELD.share(10.0 + t) for t in (0.0, 0.015, 0.03, 0.06)], [0.0, 0.25, 0.5, 1.0])


def test_a_still_hand_pushes_as_long_as_it_is_heard_of() -> None:
    hold = HELD.beat(10.05)
    for i in range(1, 250):
        now = 10.05 + 0.04 * i
        hold = hold.beat(now)
        assert hold.share(now + 0.03) == pytest.approx(1.0)


def test_without_heartbeat_the_force_is_gone_in_a_tenth_of_a_second() -> None:
    fading = [HELD.share(10.0 + t) for t in (0.06, 0.07, 0.085, 0.099)]
    np.testing.assert_allclose(fading, [1.0, 0.75, 0.375, 0.025])
    assert HELD.share(10.1) == 0.0


@pytest.mark.parametrize("late", [0.1, 0.15, 60.0])
def test_a_late_beat_brings_no_lost_hand_back(late: float) -> None:
    """HAZ-11: nobody asked for a force in between, as while the rehearsal is paused; only a press takes hold again."""
    hold, lost = HELD, 10.0 + late
    for beats in range(10):
        now = lost + 0.04 * beats
        hold = hold.beat(now)
        assert not hold.active(now)
        assert hold.share(now + 0.02) == 0.0
        assert hold.lost(now)
        assert not hold.release(now).lost(now)
    hold = hold.press(lost + 0.5)
    assert not hold.lost(lost + 0.5)
    np.testing.assert_allclose([hold.share(lost + 0.5 + t) for t in (0.0, 0.015, 0.06)], [0.0, 0.25, 1.0])


def test_a_beat_that_is_late_but_in_time_lets_the_force_rise_again_without_a_jump() -> None:
    faded = HELD.share(10.09)
    assert 0.0 < faded < 0.5
    again = HELD.beat(10.09)
    assert again.share(10.09) == pytest.approx(faded)
    assert again.share(10.14) == pytest.approx(1.0)


def test_release_fades_within_a_tenth_of_a_second() -> None:
    hold = HELD.beat(10.06).release(10.08)
    assert hold.release(10.1) == hold
    late = hold.beat(10.12)
    assert late == hold
    assert not hold.alive(10.08)
    np.testing.assert_allclose([hold.share(t) for t in (10.08, 10.1, 10.13)], [1.0, 0.8, 0.5])
    assert not hold.active(10.19)


def test_a_hand_that_takes_hold_while_its_force_fades_goes_on_from_there() -> None:
    hold = HELD.beat(10.06).release(10.08).press(10.13)
    np.testing.assert_allclose([hold.share(10.13 + t) for t in (0.0, 0.015, 0.03)], [0.5, 0.75, 1.0])
