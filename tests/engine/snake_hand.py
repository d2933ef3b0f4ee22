"""A hand on a snake that looks along a straight tube, in the steps of a control loop, for tests of what it does."""

from __future__ import annotations

import math

import numpy as np
from lumen_shapes import straight

from vfix_engine.arrays import Array
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.hand import Hand, HandInput
from vfix_engine.worlds.snake import LumenContours, SnakeSettings, SnakeState, SnakeSystemSpec
from vfix_engine.worlds.snake.settings import Arm, DriveSettings

STEP_S, BEAT_S = 0.002, 0.04


class SnakeHand:
    """Ten links in a tube of 22 mm radius under the page's control, and a hand that is heard of with its heartbeat.

    skip: control periods that a busy machine leaves out for each that it keeps.
    """

    def __init__(self, arm: Arm = "certified", skip: int = 0, links: int = 10, length_mm: float = 28.0) -> None:
        path = straight(300.0, 22.0)
        drive = DriveSettings(control="view", arm=arm, vertices_per_link=30)
        contours = LumenContours(path.centre, path.radius)
        snake = SnakeModel(links, length_mm=length_mm)
        self.system = SnakeSystemSpec(
            contours, snake, SnakeSettings(step_s=STEP_S), drive, tip_s=min(180.0, snake.reach_mm())
        ).build()
        self.hand, self.now, self.period_s = Hand(), 10.0, STEP_S * (1 + skip)
        self.state: SnakeState = self.system.start()
        self.before = self.camera

    @property
    def camera(self) -> Array:
        """(4, 4) transform_camera_to_patient."""
        return self.system.at_hand(self.state).camera

    @property
    def turned_deg(self) -> float:
        """Of the view, since the beginning."""
        return math.degrees(math.acos(min(1.0, float(self.before[:3, 2] @ self.camera[:3, 2]))))

    @property
    def moved_mm(self) -> Array:
        """(2,) to the right and down in the first picture."""
        way: Array = self.before[:3, :2].T @ (self.camera[:3, 3] - self.before[:3, 3])
        return way

    def hear(self, news: HandInput) -> None:
        self.hand.hear(news, self.now)

    def drag(self, right: float, down: float, held: bool = True) -> None:
        self.hear(self.hand.input.pulled((right, down), held, self.now))

    def run(self, seconds: float) -> None:
        """Steps, with a heartbeat."""
        every = max(1, round(BEAT_S / self.period_s))
        for tick in range(round(seconds / self.period_s)):
            if tick % every == 0:
                self.hear(self.hand.input.beaten(self.now))
            self.now += self.period_s
            command = self.hand.command(None, self.now, self.system.camera(self.state))
            self.state = self.system.step(self.state, command)
            assert np.isfinite(self.state.q).all()
