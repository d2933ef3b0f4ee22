"""A simulated person who does study I of Kwok 2013: inserts along the lumen, looks for polyps, and holds each in view.

He knows only the picture (``PolypEye``), how many polyps have gone, the force on his hand, and his own acts: not where
polyps are, nor how the robot lies. As in the paper the tip bends while the button is not pressed, and is locked while
he inserts. He straightens it by a button, which the paper does not have: there the hand has a place at which the tip is
straight (assumed to be as easy to find).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...runtime.command import BUTTON_STRAIGHTEN, no_command
from ...runtime.operator import Act
from ...runtime.requests import Request
from ...worlds.snake.requests import ChooseJoint
from ...worlds.snake.settings import Arm
from ...worlds.snake.snapshot import AtHand, SnakeSnapshot
from ...worlds.snake.stepping.manual import JOINTS
from ..person import DriftNoise
from ..polyps.aiming import REFERENCE_MM, WITHIN_MM
from ..polyps.progress import PolypProgress
from .endoscopist import DEG_PER_MM, Endoscopist
from .picture import PolypEye, SeenLumen, SeenPolyp
from .search import LookAgain, Memory
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
_LOST_S = 1.5  # for which a polyp that left the picture is followed
_STUCK_S, _STUCK_DEG, _NEARER_MM = 1.5, 1.0, 0.5  # without getting nearer: another joint, or from another place
_SHIFT_MM = 8.0  # of the robot for another place
_REST_S, _STRAIGHT_S = 0.2, 4.0  # a tip whose picture stands still for so long is straight; at most so long
_LED_S = 2.0  # for which the hand is led by a force before it goes on
_EASE_S, _EASE_AGAIN_S = 1.0, 3.0  # for which he gives way to a force at most, and goes on before he does so again
_ARRIVED_MM = 2.0  # of the place that he goes back to
_SIDE_S = 2.0  # for which he looks to the side on which a polyp was, before he looks round


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
        self._ease_s, self._felt_n = 0.0, 0.0
        self._place, self._round, self._round_left, self._side_s = np.zeros(2), 0.0, 0.0, 0.0
        self._cleared, self._change = 0, False
        self._memory = Memory(who)
        self._visit: LookAgain | None = None
        self._depth, self._moves, self._time = 0.0, True, 0.0
        self.given_up: set[int] = set()
        self.joint_choices = self.led = 0
        self._forget()

    def _forget(self) -> None:
        """Nothing is aimed at."""
        self._target: int | None = None
        self._last = np.zeros(2)
        self._lost_s, self._spent_s, self._refined_s, self._stuck_s = 0.0, 0.0, 0.0, 0.0
        self._feeding, self._resting, self._sense = False, False, 1.0
        self._best, self._shifts, self._shift_mm = (math.inf, math.inf), 0, 0.0

    def __call__(self, snapshot: AtHand | SnakeSnapshot, progress: PolypProgress) -> Act:
        """What the hand does in the next step."""
        asked: tuple[Request, ...] = ()
        force = snapshot.forces[:2]
        self._felt_n = 0.0 if self._manual else float(np.linalg.norm(force))
        if self._steps % self._every == 0:
            self._late.append(self._eye.seen(snapshot, progress))
            drift = self._drift.next()
            if len(self._late) == self._late.maxlen:  # nobody moves before having seen the start
                self._decide(self._late[0], drift)
                asked = self._chosen_joint()
        self._steps += 1
        if self._straight_s > 0.0:
            return Act(replace(no_command(), buttons=BUTTON_STRAIGHTEN), asked)
        led = self._is_led(self._felt_n)
        if self._feed and not led:
            fed = self._hand.fed(self._feed)
            if self._moves:
                self._depth += fed * self._dt
            return _act(np.zeros(2), fed, asked)
        velocity = self._hand.moved(np.zeros(2) if led else self._wanted, force)
        self._place = self._place + velocity * self._dt
        return _act(velocity, 0.0, asked)

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
        self._time += LOOK_S
        self._moves = picture.moves
        self._still_s = 0.0 if picture.moves else self._still_s + LOOK_S
        if self._straight_s > 0.0:
            self._straight_s -= LOOK_S
            if self._still_s < _REST_S + self._who.person.delay_s and self._straight_s > 0.0:
                return
            self._straight_s, self._place = 0.0, np.zeros(2)
        polyp = self._aimed_at(picture)
        if polyp is not None:
            self._memory.noticed(polyp, self._depth)
        if polyp is None and self._target is None:
            self._unaimed(picture)
            return
        self._spent_s += LOOK_S
        if self._shift_mm > 0.0:
            self._shift_mm -= self._who.insert_mm_per_s * LOOK_S
            self._insert(self._sense * self._who.insert_mm_per_s)
        elif polyp is None:
            self._search()
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
            self._leave(self._target)
            here.pop(self._target, None)
        if self._target in here:
            return here[self._target]
        if gone:  # it has disappeared under his eyes
            self._memory.gone(self._target, self._depth)
            if self._visit is not None and self._visit.number == self._target:
                self._visit = None
            self._forget()
            self._straighten()
        if self._target is None and here:
            nearest = min(here.values(), key=lambda polyp: polyp.distance_mm)
            if self._memory.left(nearest.number) and (self._visit is None or self._visit.number != nearest.number):
                return None
            if self._visit is None or self._visit.number != nearest.number:
                self._spent_s = 0.0
            self._target = nearest.number
            self._round_left = self._side_s = 0.0
            return nearest
        return None

    def _leave(self, number: int) -> None:
        """For now, or for good."""
        if self._memory.leaves(number):
            self.given_up.add(number)
        if self._visit is not None and self._visit.number == number:
            self._visit = None
        self._forget()
        self._straighten()

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

    def _unaimed(self, picture: SeenLumen) -> None:
        """Nothing is looked at: he gives way to a force first, then goes on."""
        looking = self._round_left > 0.0 or self._side_s > 0.0
        if not looking and self._eases():
            self._wanted, self._feed = np.zeros(2), 0.0
        elif self._side_s > 0.0:
            self._look_aside()
        elif self._round_left > 0.0:
            self._look_round()
        elif self._visit is not None:
            self._go_there()
        else:
            self._travel(picture)

    def _eases(self) -> bool:
        """Whether he gives way to a force: until it is half of what he minds, or for a moment; then he goes on."""
        self._ease_s -= LOOK_S
        if self._felt_n > self._who.free_n and self._ease_s <= -_EASE_AGAIN_S:
            self._ease_s = _EASE_S
        if self._ease_s > 0.0 and self._felt_n < 0.5 * self._who.free_n:
            self._ease_s = 0.0
        return self._ease_s > 0.0

    def _look_aside(self) -> None:
        """To where in the picture the polyp was, then all round."""
        self._side_s -= LOOK_S
        assert self._visit is not None
        assert self._visit.side is not None
        self._lead_to(self._who.round_mm * self._visit.side)
        if self._side_s <= 0.0:
            self._round = math.atan2(self._visit.side[1], self._visit.side[0])
            self._round_left = 2.0 * math.pi

    def _look_round(self) -> None:
        """Lead the hand once round its place with a straight tip."""
        towards = self._who.round_mm * np.array([math.cos(self._round), math.sin(self._round)])
        turn = self._who.camera_mm_per_s * LOOK_S / self._who.round_mm
        self._round, self._round_left = self._round + turn, self._round_left - turn
        self._lead_to(towards)
        if self._round_left <= 0.0:
            self._round_left = 0.0
            self._memory.looked(self._depth)
            self._straighten()

    def _lead_to(self, place: Array) -> None:
        """Lead the hand to a place (2,) in mm from that with a straight tip."""
        towards = place - self._place
        away = math.hypot(*towards)
        speed = min(self._who.camera_mm_per_s, 2.0 * away)
        self._wanted, self._feed = towards * (speed / max(away, 1e-9)), 0.0

    def _go_there(self) -> None:
        """With a straight tip to the next place of a visit, and look round there."""
        assert self._visit is not None
        if not self._visit.stands:
            number, self._visit = self._visit.number, None
            if number is not None:
                self._leave(number)
            return
        way = self._visit.stands[0] - self._depth
        stuck = self._feed != 0.0 and self._still_s > _STUCK_S
        if abs(way) > _ARRIVED_MM and not stuck:
            self._insert(math.copysign(self._who.insert_mm_per_s, way))
            return
        self._visit.stands.pop(0)
        self._wanted, self._feed, self._still_s = np.zeros(2), 0.0, 0.0
        if self._visit.side is not None:
            self._side_s = _SIDE_S
        else:
            self._round_left = 2.0 * math.pi

    def _travel(self, picture: SeenLumen) -> None:
        """Along the lumen: to where it is dark, if that is in the picture."""
        dark = picture.dark_deg()
        off = 0.0 if dark is None else math.hypot(*dark)
        if self._still_s > _STUCK_S:
            self._straighten()
            return
        if self._feed == 0.0 or self._fed_s >= _GO_ON_S:
            flexure = dark is None or off > _LEFT_DEG
            visit = self._memory.next(self._depth, picture.cleared, self._time, flexure)
            if visit is not None:
                self._visit, self._feed = visit, 0.0
                self._straighten()
                return
        if self._feed > 0.0 and (off < _LEFT_DEG or self._fed_s < _GO_ON_S):
            self._fed_s += LOOK_S
        elif dark is None or off < _CENTRED_DEG or self._turned_s > _TURN_S:
            self._turned_s = self._fed_s = 0.0
            self._insert(self._who.insert_mm_per_s)
        else:
            self._turned_s += LOOK_S
            self._go(dark)

    def _search(self) -> None:
        """A polyp that left the picture: after it, then from where it can be seen again."""
        self._lost_s += LOOK_S
        self._resting = self._feeding = False
        if self._lost_s < _LOST_S:
            self._go(self._last)
            return
        self._look_again()

    def _look_again(self) -> None:
        """From the next place from which the polyp that he is at may be seen."""
        number, spent = self._target, self._spent_s
        assert number is not None
        if self._visit is None or self._visit.number != number:
            self._visit = self._memory.visit(number)
        self._forget()
        self._spent_s = spent
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
        if self._shifts % 3 == 0:
            self._look_again()
            return
        self._sense, self._shift_mm = math.copysign(1.0, wrong_mm), _SHIFT_MM

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
