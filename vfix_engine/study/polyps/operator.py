"""An operator of study I that knows where the polyps are: an oracle, not a model of a person.

It inserts the robot to a place before a polyp and then sees what a person sees: where the target is in the picture, how
far away, and the marker. It pulls the camera to where the target is, and holds it there. In the arm 'manual' the same
pull turns one of the last two joints. Where its hand does not get there from any place, it bends the links as the plan
does that found the polyp viewable, except in the arm 'manual'.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...arrays import Array
from ...pathway.pathway import TissueMotion
from ...runtime.operator import Act
from ...worlds.snake.offline.drive_view import DriveView
from ...worlds.snake.offline.look_round import Order, bend_to, straighten
from ...worlds.snake.offline.operators import SnakeOperator, go_to, insert_to
from ...worlds.snake.offline.script import ScriptSystem
from ...worlds.snake.requests import ChooseJoint
from ...worlds.snake.stepping.command import SnakeCommand
from ...worlds.snake.stepping.manual import JOINTS
from ...worlds.snake.stepping.state import SnakeState
from .aiming import REFERENCE_MM, Aim, aim_at
from .progress import PolypProgress, Sight
from .task import PolypTask

OFFSETS_MM = (24.0, 12.0, 36.0, 0.0, 48.0, -12.0)  # of the tip before a polyp, tried in this order
_AIM_S, _HOLD_S = 0.01, 0.02  # [s] of a step while aiming and while holding
_PULL_MM_S, _FEED_MM_S = 30.0, 10.0  # speeds of the hand
_GENTLE_DEG = 15.0  # nearer to the optical axis the hand is slower in proportion
_GOOD = 0.8  # accuracy from which the hand rests
_REFINE_S = 3.0  # [s] for which a view that is good enough to count is made better, at most
_SEEK_S = 5.0  # [s] without a view until the next place is tried
_STILL_STEPS, _STILL_DEG, _STILL_MM = 30, 0.02, 0.005  # a view that changes by less for so many steps is stuck
_AHEAD_DEG, _BAND_MM = 30.0, 1.0  # the robot is fed only while the target is ahead, and to so near 15 mm
_ASIDE_DEG, _NEAR_MM = 75.0, 11.0  # it is drawn back from one that is nearer, also while it is aside
_PASSED_DEG = 110.0  # off the optical axis: the camera has passed the target
_ALONG = 0.2  # least share of a feed that changes the distance
AIM_MOST_S = 60.0  # [s] of one attempt, also where the polyp is viewed and lost again and again
_BEFORE_END_MM = 1.0  # of the tip, while polyps are left: before the place from which the task is completed


@dataclass(frozen=True)
class Attempt:
    """One place from which a polyp was tried: its index, the tip's arc length in mm at the end, and what it came to.

    how: 'hand', or 'plan' where the links were bent as planned. held_by: what held the robot last, in words.
    """

    polyp: int
    how: Literal["hand", "plan"]
    tip_mm: float
    cleared: bool
    angle_deg: float
    distance_mm: float
    held_by: str


class PolypOperator:
    """Clears the polyps in their order along the lumen, then inserts to the end of the task.

    progress: of the task, after the last step; attempts: in their order.

    Args:
        sight: lines of sight; motion: of the tissue. views: for each polyp the tip's arc length in mm and the bends
            (n, 2L') rad, one after the other, with which the plan views it; none: no plan is known.
        aim_most_s: of one attempt by hand, also where the polyp is viewed and lost again and again; while it is viewed
            at the end, the attempt goes on.
    """

    def __init__(
        self,
        task: PolypTask,
        sight: Sight,
        motion: TissueMotion | None = None,
        views: Sequence[tuple[float, Array]] = (),
        aim_most_s: float = AIM_MOST_S,
    ) -> None:
        self.task, self.progress, self.attempts = task, PolypProgress.at_start(task), list[Attempt]()
        self._sight, self._motion, self._views, self._aim_most_s = sight, motion, views, aim_most_s
        self._operator = SnakeOperator(self._orders)

    def __call__(self, system: ScriptSystem, state: SnakeState) -> Act | None:
        if state.steps:
            camera = system.constants.snake.camera(state.q, state.base)
            targets = self.task.targets(self._motion, state.t)
            self.progress = self.progress.step(self.task, camera, state.tip_s, state.t, targets, self._sight)
        return None if self.progress.completed else self._operator(system, state)

    def _orders(self, drive: DriveView) -> Iterator[Order]:
        for index in range(len(self.task.polyps)):
            yield from self._clear(drive, index)
        yield from straighten(drive)
        yield from insert_to(drive, self.task.end_mm)

    def _is_cleared(self, index: int) -> bool:
        return self.progress.viewings[index].cleared_t is not None

    def _clear(self, drive: DriveView, index: int) -> Iterator[Order]:
        """Try one polyp from one place after the other."""
        planned = self._views[index] if self._views and drive.settings.arm != "manual" else None
        polyp_s = self.task.polyps[index].s_mm
        yield from self._by_hand(drive, index, polyp_s - OFFSETS_MM[0])
        if planned is not None:
            yield from self._by_hand(drive, index, planned[0])
            yield from self._as_planned(drive, index, *planned)
        for offset in OFFSETS_MM[1:]:
            yield from self._by_hand(drive, index, polyp_s - offset)

    def _by_hand(self, drive: DriveView, index: int, place_mm: float) -> Iterator[Order]:
        place_mm = min(place_mm, self.task.done_mm - _BEFORE_END_MM, drive.length_mm)
        if place_mm > 0.0 and not self._is_cleared(index):
            yield from self._to(drive, place_mm)
            yield from self._aim(drive, index)
            self._note(drive, index, "hand")

    def _as_planned(self, drive: DriveView, index: int, place_mm: float, bends: Array) -> Iterator[Order]:
        """The distal links along planned bends, then held as long as the polyp is viewed."""
        if self._is_cleared(index):
            return
        yield from self._to(drive, place_mm)
        for bend in bends:
            yield from bend_to(drive, bend)
        while not self._is_cleared(index):
            yield Order(SnakeCommand(), _HOLD_S)
            if not self._is_viewed(index):
                break
        self._note(drive, index, "plan")

    def _to(self, drive: DriveView, place_mm: float) -> Iterator[Order]:
        """Straight to a place."""
        yield from straighten(drive)
        yield from (insert_to if place_mm > drive.tip_s else go_to)(drive, place_mm)

    def _note(self, drive: DriveView, index: int, how: Literal["hand", "plan"]) -> None:
        aim, held = self._seen(drive, index), drive.state.held_by or ""
        cleared = self._is_cleared(index)
        self.attempts.append(Attempt(index, how, drive.tip_s, cleared, aim.angle_deg, aim.distance_mm, held))

    def _seen(self, drive: DriveView, index: int) -> Aim:
        """How the camera sees a polyp now."""
        camera = drive.snake.camera(drive.q, drive.state.base)
        return aim_at(camera, self.task.targets(self._motion, drive.state.t)[index])

    def _is_viewed(self, index: int) -> bool:
        return self.progress.viewed and self.progress.target == index

    def _aim(self, drive: DriveView, index: int) -> Iterator[Order]:
        """Pull the camera to a polyp and hold it there, until it is cleared or the hand gets no farther."""
        seek, refine, until = 0.0, 0.0, drive.state.t + self._aim_most_s
        still, before, joint = 0, (math.inf, math.inf), 1
        if drive.state.hand_joint != joint:
            drive.ask(ChooseJoint(joint))
        while True:
            aim, viewed = self._seen(drive, index), self._is_viewed(index)
            if self._is_cleared(index) or (drive.state.t > until and not viewed):
                return
            if viewed and (aim.accuracy >= _GOOD or refine > _REFINE_S):
                yield Order(SnakeCommand(), _HOLD_S)
                continue
            refine, seek = (refine + _AIM_S, 0.0) if viewed else (0.0, seek + _AIM_S)
            now = (aim.angle_deg, aim.distance_mm)
            stuck = abs(now[0] - before[0]) < _STILL_DEG and abs(now[1] - before[1]) < _STILL_MM
            still, before = still + 1 if stuck else 0, now
            if still > _STILL_STEPS or seek > _SEEK_S or aim.angle_deg > _PASSED_DEG:
                if viewed:
                    refine = math.inf
                elif drive.settings.arm == "manual" and joint < JOINTS and aim.angle_deg <= _PASSED_DEG:
                    joint, still, seek = joint + 1, 0, 0.0
                    drive.ask(ChooseJoint(joint))
                else:
                    return
            yield Order(self._pull(drive, aim), _AIM_S)

    def _pull(self, drive: DriveView, aim: Aim) -> SnakeCommand:
        """The hand's motion for one step: the camera to where the target is, or the robot to 15 mm from it."""
        x, y, _ = aim.local
        feed = self._feed(drive, aim)
        if feed and (drive.state.steps % 2 or aim.angle_deg < 1.0):
            return SnakeCommand(insert_mm_per_s=feed)
        aside = max(math.hypot(x, y), 1e-9)
        speed = _PULL_MM_S * min(1.0, aim.angle_deg / _GENTLE_DEG)
        return SnakeCommand(camera_mm_per_s=(speed * x / aside, speed * y / aside))

    def _feed(self, drive: DriveView, aim: Aim) -> float:
        """mm/s of insertion that brings the distance to 15 mm; 0 where it would not."""
        off = aim.distance_mm - REFERENCE_MM
        most = _AHEAD_DEG if aim.distance_mm > _NEAR_MM else _ASIDE_DEG
        if aim.angle_deg > most or abs(off) < _BAND_MM:
            return 0.0
        camera = drive.snake.camera(drive.q, drive.state.base)
        along = float(camera[:3, :3] @ np.array(aim.local) @ drive.state.tissue.curve.tangent(drive.tip_s))
        if abs(along) < _ALONG * aim.distance_mm:
            return 0.0
        feed = math.copysign(_FEED_MM_S, off * along)
        return 0.0 if feed > 0.0 and drive.tip_s > self.task.done_mm - _BEFORE_END_MM else feed
