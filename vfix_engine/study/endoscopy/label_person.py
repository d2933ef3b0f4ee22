"""A simulated person who does study II of Kwok 2013: looks for labels in a cavity, and cuts along the line of each.

He knows only the picture (``LabelEye``), the force on his hand, where his hand is, and from the instruction that the
labels are numbered round the cavity, low and high in turns. He looks for the next one by leading his hand round, and
in the next turn where he has not looked in the last one.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...runtime.command import BUTTON_CUT, BUTTON_STRAIGHTEN, no_command
from ...runtime.operator import Act
from ...runtime.requests import Request
from ...worlds.snake.requests import ChooseJoint
from ...worlds.snake.settings import Arm
from ...worlds.snake.snapshot import AtHand, SnakeSnapshot
from ..diathermy.labels import LINE_MM
from ..diathermy.task import DiathermyState
from ..person import DriftNoise
from .cavity_picture import LabelEye, SeenCavity, SeenLabel
from .endoscopist import DEG_PER_MM, Endoscopist
from .stylus_hand import StylusHand

# How a person goes about it: all assumed.
LOOK_S = 0.05  # between two looks
_ROUND_MM, _SWING_MM = 45.0, 25.0  # of the hand from its place with a straight robot, while he looks round
_SWINGS = 2.5  # from low to high and back in one turn, so that he is high in a turn where he was low in the last one
_TURNS = 4.0 * math.pi  # [rad] round, after which it is tried otherwise
_LEAD_MM = 8.0  # of the place round to which the hand goes, ahead of where it is
_BEGIN_MM = 1.0  # of the marker from the object's aimed end: the button is pressed
_STUCK_S, _NEARER_MM = 2.5, 0.5  # without getting nearer: left for another label, and tried again later
_TRIES = 4  # at one label
_REST_S, _STRAIGHT_S = 0.2, 6.0  # a robot whose picture stands still for so long is straight; at most so long

SEARCH = (
    f"he leads his hand round at {_ROUND_MM:g} ± {_SWING_MM:g} mm from its place with a straight robot, "
    f"{_SWINGS:g} times out and in on a turn; after {_TURNS / (2.0 * math.pi):g} turns with the next joint of a manual "
    "arm, or to a label that he left"
)
"""How he looks for the next label, in words."""


class LabelPerson:
    """One person in one trial: called before each step with a snapshot and the task, returns an act.

    joint_choices: how often he chose another joint of a manual arm. given_up: labels that he left.

    Args:
        eye: what makes the picture; arm: of the robot; links: of the robot, of whose joints a manual hand chooses.
    """

    def __init__(
        self, eye: LabelEye, who: Endoscopist, arm: Arm, links: int, dt_s: float,
        seed: int | np.random.SeedSequence = 0,
    ) -> None:  # fmt: skip
        random = np.random.default_rng(seed)
        self._eye, self._who, self._dt, self._links = eye, who, dt_s, links
        self._manual = arm == "manual"
        self._hand = StylusHand(who, random, dt_s, not self._manual)
        self._drift = DriftNoise(random, LOOK_S, who.person.drift_s)
        self._round = float(random.uniform(0.0, 2.0 * math.pi))  # where he begins to look
        self._steps, self._every = 0, max(round(LOOK_S / dt_s), 1)
        self._late: deque[SeenCavity] = deque(maxlen=1 + round(who.person.delay_s / LOOK_S))
        self._wanted, self._pressed, self._joint, self._change = np.zeros(2), False, 1, False
        self._place = np.zeros(2)  # [mm] of the hand from where the robot was straight
        self._target: int | None = None
        self._best, self._stuck_s, self._still_s, self._straight_s = math.inf, 0.0, 0.0, 0.0
        self._turned = 0.0  # [rad] round, with nothing seen
        self._tries: Counter[int] = Counter()
        self._skip: int | None = None
        self.given_up: set[int] = set()
        self.joint_choices = 0

    def __call__(self, snapshot: AtHand | SnakeSnapshot, task: DiathermyState) -> Act:
        """What the hand does in the next step."""
        asked: tuple[Request, ...] = ()
        if self._steps % self._every == 0:
            self._late.append(self._eye.seen(snapshot, task))
            drift = self._drift.next()
            if len(self._late) == self._late.maxlen:  # nobody moves before having seen the start
                self._decide(self._late[0], drift)
                asked = self._chosen_joint()
        self._steps += 1
        if self._straight_s > 0.0:
            return Act(replace(no_command(), buttons=BUTTON_STRAIGHTEN), asked)
        velocity = self._hand.moved(self._wanted, snapshot.forces[:2])
        self._place = self._place + velocity * self._dt
        buttons = BUTTON_CUT if self._pressed else 0
        return Act(replace(no_command(), axes=(float(velocity[0]), float(velocity[1]), 0.0), buttons=buttons), asked)

    def _decide(self, picture: SeenCavity, drift: Array) -> None:
        """What the hand wants until the next look."""
        self._still_s = 0.0 if picture.moves else self._still_s + LOOK_S
        if self._straight_s > 0.0:
            self._straight_s -= LOOK_S
            if self._still_s < _REST_S + self._who.person.delay_s and self._straight_s > 0.0:
                return
            self._straight_s, self._place = 0.0, np.zeros(2)
        here = {one.number: one for one in picture.labels if one.number not in self.given_up | {self._skip}}
        label = here.get(self._target) if self._target is not None else None
        if label is None:
            label = min(here.values(), key=lambda one: float(np.hypot(*one.end_deg)), default=None)
            self._begin(None if label is None else label.number)
        if label is None:
            self._look_round()
        else:
            self._follow(label, self._who.see_deg * drift[:2])

    def _begin(self, target: int | None) -> None:
        if target is not None and target != self._target:
            self._skip, self._turned = None, 0.0  # another one is tried in between
        self._target, self._best, self._stuck_s = target, math.inf, 0.0

    def _go(self, off_deg: Array, most: float) -> None:
        """Pull the camera to a place of the picture."""
        angle = math.hypot(*off_deg)
        speed = min(most, angle / (DEG_PER_MM * self._who.approach_s))
        self._wanted = off_deg * (speed / angle if angle > 0.0 else 0.0)

    def _follow(self, label: SeenLabel, error_deg: Array) -> None:
        """Bring the marker to the aimed end of the object, then along its line with the button held."""
        end, tip = label.end_deg + error_deg, label.tip_deg + error_deg
        away_mm = math.hypot(*end) / label.deg_per_mm
        pressed = away_mm < _BEGIN_MM or (self._pressed and away_mm < 2.0 * _BEGIN_MM)
        if pressed and not self._pressed:
            self._best = math.inf
        self._pressed = pressed
        goal = end
        if self._pressed:
            along = tip - end
            size = max(math.hypot(*along), 1e-9)
            lead = self._who.cut_mm_per_s * self._who.approach_s * label.deg_per_mm
            goal = end + along * (lead / size)
        self._go(goal, self._who.camera_mm_per_s)
        rest = LINE_MM * label.left if self._pressed else away_mm
        if rest < self._best - _NEARER_MM:
            self._best, self._stuck_s = rest, 0.0
        else:
            self._stuck_s += LOOK_S
        if self._stuck_s > _STUCK_S:
            self._leave(label.number)

    def _leave(self, number: int) -> None:
        """It goes no farther: another joint of a manual arm; else from another side."""
        self._best, self._stuck_s = math.inf, 0.0
        self._tries[number] += 1
        most = _TRIES * self._links if self._manual else _TRIES
        if self._tries[number] >= most:
            self.given_up.add(number)
        if self._manual:
            self._change = True
        else:
            self._skip, self._pressed = number, False
            self._straighten()

    def _straighten(self) -> None:
        self._straight_s, self._still_s, self._wanted = _STRAIGHT_S, 0.0, np.zeros(2)

    def _look_round(self) -> None:
        """Lead the hand round its place with a straight robot, out and in on the way."""
        self._pressed = False
        if self._still_s > _STUCK_S:
            self._change, self._still_s = True, 0.0
            if not self._manual:
                self._straighten()
                self._round += 1.0
                return
        speed = self._who.camera_mm_per_s
        radius = _ROUND_MM + _SWING_MM * math.sin(_SWINGS * self._round)
        towards = radius * np.array([math.cos(self._round), math.sin(self._round)]) - self._place
        away = math.hypot(*towards)
        if away < _LEAD_MM:  # the place round waits for the hand
            turn = speed * LOOK_S / _ROUND_MM
            self._round, self._turned = self._round + turn, self._turned + turn
        if self._turned > _TURNS:  # nothing more from here: with the next joint of a manual arm, or one left before
            self._turned, self._change, self._skip = 0.0, True, None
        self._wanted = towards * (speed / max(away, speed * LOOK_S))

    def _chosen_joint(self) -> tuple[Request, ...]:
        """The next joint, by the button of a manual arm, from the last one to the first and again."""
        change, self._change = self._change and self._manual, False
        if not change:
            return ()
        self._joint = self._joint % self._links + 1
        self.joint_choices += 1
        return (ChooseJoint(self._joint),)
