"""A drag and a wheel in a camera's picture are positions: few messages or many, a fast robot or a slow one, as far.

Nothing of them is left after a release, a pause or a lost hand (HAZ-11).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from vfix_engine.arrays import Array
from vfix_engine.runtime import Command
from vfix_engine.runtime.camera_hand import DrivenCamera
from vfix_engine.runtime.hand import INPUT_BYTES, Hand, HandInput
from vfix_engine.runtime.virtual_coupling import GONE_S, NOBODY

STEP_MM, INSERTION_STEP_MM, PERIOD_S = 0.06, 0.04, 0.002
WAY = np.array([6.0, -3.0])


class Camera:
    """A robot that carries out a share of each command of its camera, and hears a hand.

    share: less than 1 as of joints that are as fast as they may be. late: control periods that the machine skips for
    each that it keeps.
    """

    def __init__(self, share: float = 1.0, late: int = 0) -> None:
        self.hand, self.now, self.share, self.period_s = Hand(), 10.0, share, PERIOD_S * (1 + late)
        self.place, self.depth = np.zeros(2), 0.0
        self.commands: list[Command] = []

    def hear(self, news: HandInput) -> None:
        self.hand.hear(news, self.now)

    def drag(self, way: Array, held: bool = True) -> None:
        self.hear(self.hand.input.pulled((float(way[0]), float(way[1])), held, self.now))

    def wheel(self, depth: float, held: bool = True) -> None:
        self.hear(self.hand.input.wheeled(depth, held, self.now))

    def run(self, seconds: float, beat: bool = True) -> Array:
        """The place of the camera (2,) mm after so long."""
        for tick in range(round(seconds / self.period_s)):
            self.now += self.period_s
            if beat and tick % max(1, round(0.04 / self.period_s)) == 0:
                self.hear(self.hand.input.beaten(self.now))
            obeyed = float(self.place[0]), float(self.place[1])
            camera = DrivenCamera(obeyed, STEP_MM, self.depth, INSERTION_STEP_MM)
            command = self.hand.command(None, self.now, camera)
            assert max(abs(axis) for axis in command.axes) <= 1.0
            self.commands.append(command)
            self.place = self.place + self.share * STEP_MM * np.array(command.axes[:2])
            self.depth += self.share * INSERTION_STEP_MM * command.axes[2]
        return self.place


def dragged(camera: Camera, messages: int, seconds: float = 0.4, hold_s: float = 4.0) -> Array:
    """Drag by ``WAY`` in so many messages, and hold."""
    camera.drag(np.zeros(2))
    for part in np.linspace(0.0, 1.0, messages + 1)[1:]:
        camera.run(seconds / messages)
        camera.drag(part * WAY)
    return camera.run(hold_s)


@pytest.mark.parametrize("messages", [1, 3, 200])
@pytest.mark.parametrize(("share", "late"), [(1.0, 0), (0.35, 0), (1.0, 9), (0.35, 9)])
def test_few_messages_and_many_come_to_the_same_place_on_a_slow_machine_too(
    messages: int, share: float, late: int
) -> None:
    place = dragged(Camera(share, late), messages, hold_s=20.0 if late else 4.0)
    np.testing.assert_allclose(place, WAY, atol=2e-3)


def test_a_drag_is_no_faster_than_a_full_axis() -> None:
    camera = Camera()
    places = [camera.place]
    camera.drag(np.zeros(2))
    camera.drag(WAY)
    places += [camera.run(PERIOD_S) for _ in range(100)]
    assert max(float(np.linalg.norm(b - a)) for a, b in pairwise(places)) <= STEP_MM * (1.0 + 1e-9)


def test_nothing_moves_after_the_release_and_the_next_drag_begins_anew() -> None:
    camera = Camera()
    camera.drag(np.zeros(2))
    camera.drag(WAY)
    part = camera.run(0.1)
    camera.drag(WAY, held=False)
    np.testing.assert_array_equal(camera.run(1.0), part)
    assert 0.5 < float(np.linalg.norm(part)) < 4.0
    camera.drag(np.array([2.0, 2.0]))  # its first message was lost: what was told before counts for nothing
    np.testing.assert_array_equal(camera.run(0.5), part)
    camera.drag(np.array([3.0, 2.0]))
    np.testing.assert_allclose(camera.run(1.0), part + np.array([1.0, 0.0]), atol=2e-3)


def test_a_hand_that_is_lost_stands_and_goes_on_with_the_same_drag_when_it_is_heard_again() -> None:
    camera = Camera()
    camera.drag(np.zeros(2))
    camera.drag(WAY)
    camera.run(0.06)
    camera.run(GONE_S + 0.01, beat=False)
    lost = camera.place
    assert not camera.hand.input.lost(camera.now), "nothing has to be pressed anew"
    np.testing.assert_array_equal(camera.run(1.0), lost)
    camera.drag(WAY)
    np.testing.assert_allclose(camera.run(2.0), WAY, atol=2e-3)


def test_what_was_dragged_before_a_pause_moves_nothing_after_it() -> None:
    camera = Camera()
    camera.drag(np.zeros(2))
    camera.drag(WAY)
    part = camera.run(0.1)
    camera.hand.go_on(camera.now)
    np.testing.assert_array_equal(camera.run(0.5), part)
    camera.drag(WAY + np.array([1.0, 0.0]))
    np.testing.assert_allclose(camera.run(1.0), part + np.array([1.0, 0.0]), atol=2e-3)


def test_what_lets_go_of_everything_ends_a_drag_at_once() -> None:
    camera = Camera()
    camera.drag(np.zeros(2))
    camera.drag(WAY)
    part = camera.run(0.05)
    camera.hear(camera.hand.input.released(camera.now))
    np.testing.assert_array_equal(camera.run(0.5), part)


@pytest.mark.parametrize("share", [1.0, 0.4, 0.0])
def test_a_key_beside_a_drag_adds_its_own_way_and_owes_none(share: float) -> None:
    """Also where the robot is held: what a key could not move, the drag does not make up for."""
    camera = Camera(share)
    camera.drag(np.zeros(2))
    camera.hear(_stick(camera, 0.25))
    by_key = camera.run(1.0)
    np.testing.assert_allclose(by_key, [share * 0.25 * STEP_MM * (1.0 - 0.03) / PERIOD_S, 0.0], atol=0.05)
    camera.hear(_stick(camera, 0.0))
    camera.share = 1.0
    np.testing.assert_allclose(camera.run(1.0), by_key, atol=2e-3)
    camera.drag(WAY)
    np.testing.assert_allclose(camera.run(2.0), by_key + WAY, atol=2e-3)


def test_a_drag_travels_as_any_input_does() -> None:
    news = HandInput().pulled((1.0, 2.0), True, 5.0).pulled((1.5, -2.0), True, 5.1)
    assert (news.drags, news.dragged) == (1, (0.5, -4.0))
    assert len(news.to_bytes()) < INPUT_BYTES
    assert HandInput.from_bytes(news.to_bytes()) == news


@pytest.mark.parametrize(("share", "late"), [(1.0, 0), (0.35, 0), (1.0, 9)])
@pytest.mark.parametrize("depth", [5.0, -2.0, 0.01])
def test_a_wheel_comes_to_its_depth_and_never_past_it(share: float, late: int, depth: float) -> None:
    camera, passed = Camera(share, late), []
    camera.wheel(depth)
    for _ in range(40):
        camera.run(0.1)
        passed.append(camera.depth)
    assert camera.depth == pytest.approx(depth, abs=2e-3)
    assert max(abs(at) for at in passed) <= abs(depth) + 1e-12
    assert (np.sign(depth) * np.diff(passed) >= -1e-12).all(), "it does not swing"


def test_the_next_notch_of_a_wheel_goes_on_from_the_depth_of_the_last_and_beside_a_drag() -> None:
    camera = Camera()
    camera.drag(np.zeros(2))
    camera.drag(WAY)
    camera.wheel(5.0)
    camera.run(0.1)
    camera.wheel(10.0)
    np.testing.assert_allclose(camera.run(2.0), WAY, atol=2e-3)
    assert camera.depth == pytest.approx(10.0, abs=2e-3)


def test_a_wheel_that_is_let_go_of_lost_or_paused_inserts_no_more() -> None:
    camera = Camera()
    for stop in ("let go", "lost", "paused", "all released"):
        camera.wheel(camera.depth + 8.0)
        camera.run(0.1)
        if stop == "let go":
            camera.wheel(camera.depth + 8.0, held=False)
        elif stop == "lost":
            camera.run(GONE_S + 0.01, beat=False)
        elif stop == "paused":
            camera.hand.go_on(camera.now)
        else:
            camera.hear(camera.hand.input.released(camera.now))
        stood = camera.depth
        camera.run(0.5)
        assert camera.depth == stood, stop
        assert 1.0 < stood % 8.0 < 7.0, stop
        camera.wheel(stood, held=False)


def test_a_key_that_inserts_takes_over_from_the_wheel_which_does_not_go_back_afterwards() -> None:
    camera = Camera()
    camera.wheel(5.0)
    camera.run(2.0)
    camera.hear(_stick(camera, insert=1.0))
    camera.run(1.0)
    assert camera.depth > 20.0
    camera.hear(_stick(camera))
    by_key = camera.depth
    camera.wheel(5.0)  # told again: the page has not heard yet
    camera.run(1.0)
    assert camera.depth == pytest.approx(by_key, abs=0.5)
    camera.wheel(by_key + 5.0)
    camera.run(1.0)
    assert camera.depth == pytest.approx(by_key + 5.0, abs=2e-3)


def test_a_wheel_travels_as_any_input_does() -> None:
    news = HandInput().wheeled(12.5, True, 5.0).wheeled(12.5, True, 5.1).wheeled(17.5, True, 5.1)
    assert (news.depths, news.depth_mm) == (2, 17.5)
    assert len(news.to_bytes()) < INPUT_BYTES
    assert HandInput.from_bytes(news.to_bytes()) == news


def _stick(camera: Camera, x: float = 0.0, insert: float = 0.0) -> HandInput:
    """What is heard of a key that moves the camera or inserts."""
    hand = camera.hand.input
    return replace(hand, axes=(x, 0.0, insert), stick=hand.stick.press(camera.now) if x or insert else NOBODY)
