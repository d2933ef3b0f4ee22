"""A simulated person who does study I of Kwok 2013: inserts along the lumen, looks for polyps, and holds each in view.

He knows only the picture (``PolypEye``) and the force on his hand: not where polyps are, nor how the robot lies. As in
the paper the tip bends while the button is not pressed, and is locked while he inserts. He straightens it by a button,
which the paper does not have: there the hand has a place at which the tip is straight (assumed to be as easy to find).
"""

from __future__ import annotations

import math
from collections import Counter, deque
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...runtime.command import BUTTON_STRAIGHTEN, no_command
from ...runtime.operator import Act
from ...runtime.requests import Request
from ...worlds.snake.requests import ChooseJoint
from ...worlds.snake.settings import Arm
from ...worlds.snake.snapshot import SnakeSnapshot
from ...worlds.snake.stepping.manual import JOINTS
from ..person import DriftNoise
from ..polyps.aiming import REFERENCE_MM, WITHIN_MM
from ..polyps.progress import PolypProgress
from .endoscopist import DEG_PER_MM, Endoscopist
from .picture import PolypEye, SeenLumen, SeenPolyp
from .stylus_hand import StylusHand

# How a person goes about it: all assumed.
LOOK_S = 0.05  # between two looks
_AHEAD_DEG = 27.0  # a polyp nearer to the picture's edge is turned to before the robot is inserted further
_NEAR_MM = 26.0  # from here a polyp is aimed at; farther away the robot is inserted towards it
_ON_DEG, _OFF_DEG = 7.0, 14.0  # aimed well enough to mind the distance, and no longer
_DISTANCE_MM = 2.5  # off 15 mm: near enough
_REFINE_S = 4.0  # for which a view that counts is made better; then the hand rests
_POOR = 0.15  # value of the marker with which it rests then
_SLOWEST = 0.25  # of the speed of insertion: near 15 mm, so that the hand does not pass it
_CENTRED_DEG, _LEFT_DEG = 12.0, 28.0  # from the dark place: to begin to insert, and to stop
_TURN_S, _GO_ON_S = 1.5, 1.0  # he turns to the dark place for so long at most, and inserts for so long at least
_LOST_S, _BACK_MM, _SEEK_S = 1.5, 20.0, 4.0  # a polyp out of the picture is followed, the robot drawn back; then left
_LOSSES = 3  # after which a polyp is not looked for any more
_STUCK_S, _STUCK_DEG, _NEARER_MM = 1.5, 1.0, 0.5  # without getting nearer: another joint, or from another place
_SHIFT_MM = 8.0  # of the robot for another place
_REST_S, _STRAIGHT_S = 0.2, 4.0  # a tip whose picture stands still for so long is straight; at most so long
_LED_S = 2.0  # for which the hand is led by a force before it goes on


class PolypPerson:
    """One person in one trial: called before each step with a snapshot and the task's progress, returns an act.

    given_up: polyps that he left. joint_choices: how often he took the other joint. led: how often a force on his hand
    made him stop to insert.

    Args:
        eye: what makes the picture; arm: of the robot, which he was told; dt_s: of a step; seed: of every random
            number: the same pictures and forces give the same acts.
    """

    def __init__(
        self, eye: PolypEye, who: Endoscopist, arm: Arm, dt_s: float, seed: int | np.random.SeedSequence = 0
    ) -> None:
        random = np.random.default_rng(seed)
        self._eye, self._who, self._dt = eye, who, dt_s
        self._manual = arm == "manual"  # without forces on the stylus
        self._hand = StylusHand(who, random, dt_s, not self._manual)
        self._drift = DriftNoise(random, LOOK_S, who.person.drift_s)
        self._steps, self._every = 0, max(round(LOOK_S / dt_s), 1)
        self._late: deque[SeenLumen] = deque(maxlen=1 + round(who.person.delay_s / LOOK_S))
        self._wanted, self._feed, self._joint = np.zeros(2), 0.0, 1
        self._led_s, self._turned_s, self._fed_s, self._still_s, self._straight_s = 0.0, 0.0, 0.0, 0.0, 0.0
        self._cleared, self._change = 0, False
        self._losses: Counter[int] = Counter()
        self.given_up: set[int] = set()
        self.joint_choices = self.led = 0
        self._forget()

    def _forget(self) -> None:
        """Nothing is aimed at."""
        self._target: int | None = None
        self._last = np.zeros(2)
        self._lost_s, self._spent_s, self._refined_s, self._stuck_s = 0.0, 0.0, 0.0, 0.0
        self._back_mm, self._feeding, self._resting, self._sense = 0.0, False, False, 1.0
        self._best, self._shifts, self._shift_mm = (math.inf, math.inf), 0, 0.0

    def __call__(self, snapshot: SnakeSnapshot, progress: PolypProgress) -> Act:
        """What the hand does in the next step."""
        asked: tuple[Request, ...] = ()
        if self._steps % self._every == 0:
            self._late.append(self._eye.seen(snapshot, progress))
            drift = self._drift.next()
            if len(self._late) == self._late.maxlen:  # nobody moves before having seen the start
                self._decide(self._late[0], drift)
                asked = self._chosen_joint()
        self._steps += 1
        if self._straight_s > 0.0:
            return Act(replace(no_command(), buttons=BUTTON_STRAIGHTEN), asked)
        force = snapshot.forces[:2]
        led = self._is_led(float(np.linalg.norm(force)))
        if self._feed and not led:
            return _act(np.zeros(2), self._hand.fed(self._feed), asked)
        return _act(self._hand.moved(np.zeros(2) if led else self._wanted, force), 0.0, asked)

    def _is_led(self, felt_n: float) -> bool:
        """Whether he lets his hand be led: a force while he inserts says that the robot is out of its way."""
        if self._manual:
            return False
        self._led_s -= self._dt
        if self._feed and felt_n > self._who.careful_n and self._led_s <= -_LED_S:
            self._led_s, self.led = _LED_S, self.led + 1
        if self._led_s > 0.0 and felt_n < 0.5 * self._who.careful_n:
            self._led_s = 0.0
        return self._led_s > 0.0

    def _decide(self, picture: SeenLumen, drift: Array) -> None:
        """What the hand wants until the next look."""
        self._still_s = 0.0 if picture.moves else self._still_s + LOOK_S
        if self._straight_s > 0.0:
            self._straight_s -= LOOK_S
            if self._still_s < _REST_S + self._who.person.delay_s and self._straight_s > 0.0:
                return
            self._straight_s = 0.0
        polyp = self._aimed_at(picture)
        if polyp is None and self._target is None:
            self._travel(picture)
            return
        self._spent_s += LOOK_S
        if self._shift_mm > 0.0:
            self._shift_mm -= self._who.insert_mm_per_s * LOOK_S
            self._insert(self._sense * self._who.insert_mm_per_s)
        elif polyp is None:
            self._search(picture)
        else:
            off = polyp.off_deg + self._who.see_deg * drift[:2]
            distance = polyp.distance_mm * (1.0 + self._who.see_distance * float(drift[2]))
            self._lost_s, self._last = 0.0, off
            self._aim(picture, off, distance)

    def _aimed_at(self, picture: SeenLumen) -> SeenPolyp | None:
        """The polyp that he is at, or another one that has come into the picture."""
        here = {polyp.number: polyp for polyp in picture.polyps if polyp.number not in self.given_up}
        gone = picture.cleared > self._cleared
        self._cleared = picture.cleared
        if self._target is not None and self._spent_s > self._who.patience_s and not picture.marker:
            self.given_up.add(self._target)
            here.pop(self._target, None)
            self._forget()
            self._straighten()
        if self._target in here:
            return here[self._target]
        if gone:  # it has disappeared under his eyes
            self._forget()
            self._straighten()
        if self._target is None and here:
            nearest = min(here.values(), key=lambda polyp: polyp.distance_mm)
            self._target = nearest.number
            return nearest
        return None

    def _go(self, off_deg: Array) -> None:
        """Pull the camera to a place of the picture."""
        angle = math.hypot(*off_deg)
        speed = min(self._who.camera_mm_per_s, angle / (DEG_PER_MM * self._who.approach_s))
        self._wanted, self._feed = off_deg * (speed / angle if angle > 0.0 else 0.0), 0.0

    def _insert(self, speed: float) -> None:
        self._wanted, self._feed = np.zeros(2), speed

    def _straighten(self) -> None:
        """From now on until the picture stands still."""
        self._straight_s, self._still_s, self._fed_s = _STRAIGHT_S, 0.0, 0.0
        self._wanted, self._feed = np.zeros(2), 0.0

    def _travel(self, picture: SeenLumen) -> None:
        """Along the lumen: to where it is dark, if that is in the picture."""
        dark = picture.dark_deg
        off = 0.0 if dark is None else math.hypot(*dark)
        if self._still_s > _STUCK_S:
            self._straighten()
        elif self._feed > 0.0 and (off < _LEFT_DEG or self._fed_s < _GO_ON_S):
            self._fed_s += LOOK_S
        elif dark is None or off < _CENTRED_DEG or self._turned_s > _TURN_S:
            self._turned_s = self._fed_s = 0.0
            self._insert(self._who.insert_mm_per_s)
        else:
            self._turned_s += LOOK_S
            self._go(dark)

    def _search(self, picture: SeenLumen) -> None:
        """A polyp that left the picture: after it, then back to where it was seen."""
        self._lost_s += LOOK_S
        self._resting = self._feeding = False
        if self._lost_s < _LOST_S:
            self._go(self._last)
        elif self._back_mm < _BACK_MM and self._lost_s < _SEEK_S:
            self._back_mm += self._who.insert_mm_per_s * LOOK_S
            self._insert(-self._who.insert_mm_per_s)
        else:
            assert self._target is not None
            self._losses[self._target] += 1
            if self._losses[self._target] >= _LOSSES:
                self.given_up.add(self._target)
            self._forget()
            self._straighten()

    def _aim(self, picture: SeenLumen, off: Array, distance: float) -> None:
        """Turn to a polyp, mind the distance, and rest when the marker is yellow enough."""
        angle, wrong = math.hypot(*off), distance - REFERENCE_MM
        if picture.marker > 0.0:
            self._refined_s += LOOK_S
            least = self._who.content if not self._resting else 0.5 * self._who.content
            self._resting = picture.marker >= (least if self._refined_s < _REFINE_S else _POOR)
        else:
            self._resting, self._refined_s = False, 0.0
        if self._resting:
            self._stuck_s = 0.0
            self._go(off if angle > _ON_DEG else np.zeros(2))
            return
        if distance > _NEAR_MM:
            self._feeding = angle < _AHEAD_DEG
        elif self._feeding:
            self._feeding = angle < _OFF_DEG and abs(wrong) > 0.5 * _DISTANCE_MM
        else:
            self._feeding = angle < _ON_DEG and abs(wrong) > _DISTANCE_MM
        if not self._gets_nearer(angle, abs(wrong)):
            self._try_otherwise(wrong)
        elif self._feeding:
            share = min(1.0, max(abs(wrong) / (2.0 * WITHIN_MM), _SLOWEST))
            self._insert(math.copysign(share * self._who.insert_mm_per_s, wrong))
        else:
            self._go(off)

    def _gets_nearer(self, angle: float, wrong_mm: float) -> bool:
        """Whether angle or distance have become better within the last moments."""
        best_angle, best_mm = self._best
        if angle < best_angle - _STUCK_DEG or wrong_mm < best_mm - _NEARER_MM:
            self._best, self._stuck_s = (angle, wrong_mm), 0.0
            return True
        self._stuck_s += LOOK_S
        return self._stuck_s < _STUCK_S

    def _try_otherwise(self, wrong_mm: float) -> None:
        """With the other joint of a manual arm, else from another place: nearer to the right distance, or back."""
        self._best, self._stuck_s = (math.inf, math.inf), 0.0
        self._wanted, self._feed = np.zeros(2), 0.0
        self._shifts += 1
        if self._manual and self._shifts % JOINTS:
            self._change = True
            return
        towards = math.copysign(1.0, wrong_mm)
        self._sense, self._shift_mm = towards if self._shifts % 3 else -towards, _SHIFT_MM

    def _chosen_joint(self) -> tuple[Request, ...]:
        """The other joint, by the button of a manual arm."""
        change, self._change = self._change and self._manual, False
        if not change or self._feed:
            return ()
        self._joint = self._joint % JOINTS + 1
        self.joint_choices += 1
        return (ChooseJoint(self._joint),)


def _act(camera: Array, insert: float, asked: tuple[Request, ...]) -> Act:
    """mm/s of the camera and of insertion, for ``ScriptSystem``."""
    return Act(replace(no_command(), axes=(float(camera[0]), float(camera[1]), float(insert))), asked)
