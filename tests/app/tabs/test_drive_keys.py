"""Keys of the Drive tab: four directions of the camera, as slow as a hand that only says for how long needs it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from app.drives.commands import Push
from app.tabs.drive.commands import TiltCamera
from app.tabs.drive.keys import KEY_CAMERA_MM_PER_S, key_axes
from vfix_engine.arrays import Array
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.hand import Hand, HandInput
from vfix_engine.runtime.virtual_coupling import NOBODY
from vfix_engine.worlds.snake import DriveSettings, SnakeSettings, SnakeSystem, SnakeSystemSpec
from vfix_engine.worlds.snake.spec import LumenContours

FULL = SnakeSettings().camera_mm_per_s
RIGHT, LEFT = (Push(type="twist", direction=one) for one in (1, -1))
UP, DOWN = (TiltCamera(type="tilt", direction=one) for one in (1, -1))
STEP_S, BEAT_STEPS = 0.002, 20


@pytest.fixture(scope="module")
def tube() -> SnakeSystem:
    """Ten links in a straight tube of 22 mm radius under the page's control."""
    centre = np.column_stack([np.zeros((31, 2)), np.linspace(0.0, 300.0, 31)])
    drive = DriveSettings(control="view", vertices_per_link=30)
    settings = SnakeSettings(step_s=STEP_S)
    contours = LumenContours(centre, np.full(31, 22.0))
    return SnakeSystemSpec(contours, SnakeModel(10), settings, drive, tip_s=180.0).build()


def held(tube: SnakeSystem, key: Push | TiltCamera, seconds: float) -> tuple[Array, float]:
    """Where the view is turned to in the first picture, (right, down), and by how many degrees, by a key that is held
    so long.
    """
    state, hand, now = tube.start(), Hand(), 10.0
    before = tube.at_hand(state).camera
    pressed = HandInput(axes=key_axes(key, FULL), stick=NOBODY.press(now))
    hand.hear(pressed, now)
    for tick in range(round((seconds + 0.2) / STEP_S)):
        if tick == round(seconds / STEP_S):
            hand.hear(replace(hand.input, axes=(0.0, 0.0, 0.0), stick=NOBODY), now)
        elif tick % BEAT_STEPS == 0:
            hand.hear(hand.input.beaten(now), now)
        now += STEP_S
        state = tube.step(state, hand.command(None, now, tube.camera(state)))
    x, y, z = before[:3, :3].T @ tube.at_hand(state).camera[:3, 2]
    return np.array([x, y]), math.degrees(math.acos(min(1.0, float(z))))


@pytest.mark.parametrize(("key", "to"), [(RIGHT, (1, 0)), (LEFT, (-1, 0)), (UP, (0, -1)), (DOWN, (0, 1))])
def test_a_tap_turns_the_view_a_little_and_a_hold_a_quarter_of_a_picture(
    tube: SnakeSystem, key: Push | TiltCamera, to: tuple[int, int]
) -> None:
    """To the side of the key; a picture of 70° is four such holds wide."""
    _, tap = held(tube, key, 0.1)
    way, hold = held(tube, key, 0.65)
    assert 1.4 <= tap <= 3.0
    assert 10.0 <= hold <= 15.5
    np.testing.assert_allclose(way / np.linalg.norm(way), to, atol=0.02)


def test_a_key_has_its_speed_whatever_a_full_axis_has_and_no_more_than_that() -> None:
    for full in (KEY_CAMERA_MM_PER_S, 30.0, 200.0):
        assert full * key_axes(RIGHT, full)[0] == pytest.approx(KEY_CAMERA_MM_PER_S)
    assert key_axes(RIGHT, 2.0) == (1.0, 0.0, 0.0)
    assert key_axes(Push(type="drive", direction=-1), 30.0) == (0.0, 0.0, -1.0)
    assert key_axes(TiltCamera(type="tilt", direction=0), 30.0) == (0.0, 0.0, 0.0)
