"""A drag of the camera in a real robot: it comes as far as the pointer, and no farther than the certificate permits."""

from __future__ import annotations

import numpy as np
import pytest
from snake_hand import SnakeHand

from vfix_engine.worlds.snake.settings import Arm

WAY = np.array([3.0, -1.5])


def dragged(hand: SnakeHand, messages: int, seconds: float = 0.2, hold_s: float = 1.5) -> SnakeHand:
    hand.drag(0.0, 0.0)
    for part in np.linspace(0.0, 1.0, messages + 1)[1:]:
        hand.run(seconds / messages)
        hand.drag(float(part * WAY[0]), float(part * WAY[1]))
    hand.run(hold_s)
    return hand


@pytest.mark.parametrize("arm", ["certified", "guided"])
def test_the_view_comes_to_the_same_place_by_few_messages_and_many_and_where_steps_are_left_out(arm: Arm) -> None:
    hands = [dragged(SnakeHand(arm), 1), dragged(SnakeHand(arm), 20), dragged(SnakeHand(arm, skip=9), 2, hold_s=10.0)]
    for hand in hands:
        np.testing.assert_allclose(hand.moved_mm, WAY, atol=0.1)
        np.testing.assert_allclose(hand.camera[:3, 2], hands[0].camera[:3, 2], atol=0.01)
    assert hands[0].turned_deg > 7.0


def test_after_the_release_nothing_moves() -> None:
    hand = SnakeHand()
    hand.drag(0.0, 0.0)
    right, down = float(WAY[0]), float(WAY[1])
    hand.drag(right, down)
    hand.run(0.1)
    hand.drag(right, down, held=False)
    q = hand.state.q
    hand.run(0.3)
    np.testing.assert_array_equal(hand.state.q, q)
    assert 0.3 < float(np.linalg.norm(hand.moved_mm)) < 3.0


def test_a_drag_beyond_the_bounds_keeps_them() -> None:
    hand = SnakeHand()
    hand.drag(0.0, 0.0)
    hand.drag(60.0, 0.0)
    hand.run(2.0)
    assert hand.state.outcome in ("shrunk", "held")
    assert float((hand.state.deviation.depth - hand.state.bound)[hand.state.measured].max()) <= 0.0
    assert hand.state.obeyed_mm[0] < 59.0


def test_a_drag_comes_back_with_the_pointer() -> None:
    straight, back = SnakeHand(), SnakeHand()
    back.drag(0.0, 0.0)
    back.drag(20.0, 0.0)
    back.run(0.5)  # still on its way
    for hand in (straight, back):
        hand.drag(0.0, 0.0)
        hand.drag(5.0, 0.0)
        hand.run(1.5)
        np.testing.assert_allclose(hand.state.obeyed_mm, [5.0, 0.0], atol=0.01)
    assert back.turned_deg == pytest.approx(straight.turned_deg, abs=2.0)


def test_a_manual_hand_turns_its_joint_by_the_way_of_the_pointer() -> None:
    hand = dragged(SnakeHand("manual"), 3)
    lever = hand.system.constants.distal.length_mm + hand.system.constants.distal.camera_offset_mm
    np.testing.assert_allclose(hand.state.q[-2:], [-WAY[1] / lever, WAY[0] / lever], atol=1e-3)
