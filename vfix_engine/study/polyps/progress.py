"""Progress of study I: which polyp is aimed at, for how long, and which have been viewed.

``PolypProgress.step`` is a pure function: a live drive, a replay and the reading of a run call it with the poses after
the same steps and get the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from ...arrays import Array, IntArray
from ...errors import InputError
from .aiming import REFERENCE_MM, Aim, aim_at, may_be_within
from .task import PolypTask

Sight = Callable[[Array, int, float], bool]
"""Whether the line from an eye (3,) LPS mm to a polyp of that index is free at a time in s; ``LumenSight`` is one."""

_SAME_S = 1e-9  # sums of steps are rounded


class Viewing(NamedTuple):
    """What was seen of one polyp so far.

    held_s: viewed since the view was last lost; viewed_s: in all. distance_mm_s, angle_deg_s: integrals of the errors
    over the latter. lost: how often the view was lost before the polyp was cleared. cleared_t: s, None before.
    """

    held_s: float = 0.0
    viewed_s: float = 0.0
    distance_mm_s: float = 0.0
    angle_deg_s: float = 0.0
    lost: int = 0
    cleared_t: float | None = None


@dataclass(frozen=True)
class PolypProgress:
    """The task after a step.

    t: s. viewings: of each polyp. target: index of the polyp that is aimed at, None when all are cleared; aim: how the
    camera sees it; viewed: within the tolerances, with a free line of sight. reached_t: s at which the task was
    completed, None before; nothing changes after that.
    """

    t: float
    viewings: tuple[Viewing, ...]
    target: int | None = None
    aim: Aim | None = None
    viewed: bool = False
    reached_t: float | None = None

    @classmethod
    def at_start(cls, task: PolypTask, t: float = 0.0) -> Self:
        """Before the first step."""
        return cls(t, (Viewing(),) * len(task.polyps))

    @property
    def marker(self) -> float:
        """Colour of the aiming marker, from 0, blue, while nothing is viewed, to 1, bright yellow, at 15 mm and 0°."""
        return self.aim.accuracy if self.viewed and self.aim is not None else 0.0

    @property
    def cleared(self) -> int:
        """How many polyps have been viewed for long enough."""
        return sum(viewing.cleared_t is not None for viewing in self.viewings)

    @property
    def held_s(self) -> float:
        """For how long the target has been viewed."""
        return 0.0 if self.target is None else self.viewings[self.target].held_s

    @property
    def completed(self) -> bool:
        """Whether the robot has reached the end of the task."""
        return self.reached_t is not None

    def step(
        self,
        task: PolypTask,
        camera: Array,
        tip_mm: float,
        t: float,
        targets: Array,
        sight: Sight,
        near: IntArray | None = None,
    ) -> PolypProgress:
        """The progress after a step.

        A polyp is viewed while the line of sight is free, it is in the aiming frame, 15 ± 7 mm away and within 20° of
        the optical axis. Viewed at both ends of a step, it is viewed during it. Of several the one that was viewed
        before goes on being aimed at, or else that which is seen best; of none the nearest along the lumen to what is
        15 mm ahead of the tip.

        Args:
            camera: (4, 4) transform_camera_to_patient after the step; its y axis is down in the picture.
            tip_mm: arc length of the tip; t: s after the step. targets: (n, 3) LPS mm, ``PolypTask.targets`` at t.
            sight: asked only about polyps that are within the tolerances.
            near: indices of the targets that ``may_be_within``; None: found here.

        Raises:
            InputError: a time before that of the last step.
        """
        if self.completed:
            return self
        if t < self.t:
            raise InputError(f"a step at {t:g} s after one at {self.t:g} s: begin with PolypProgress.at_start")
        if near is None:
            near = np.flatnonzero(may_be_within(camera[None], targets[None])[0])
        target, aim = self._seen(camera, t, targets, sight, near)
        viewed = target is not None
        if target is None:
            nearest = int(self.nearest(task, np.array([tip_mm]))[0])
            target, aim = (None, None) if nearest < 0 else (nearest, aim_at(camera, targets[nearest]))
        viewings = self._after(target if viewed else None, aim, t, task.hold_s)
        reached = t if tip_mm >= task.done_mm else None
        return PolypProgress(t, viewings, target, aim, viewed, reached)

    def nearest(self, task: PolypTask, tip_mm: Array) -> IntArray:
        """(n,) index of the polyp left that is nearest along the lumen to what is 15 mm ahead of the tip; −1: none."""
        left = np.array([k for k, viewing in enumerate(self.viewings) if viewing.cleared_t is None], dtype=np.int64)
        if not len(left):
            return np.full(len(tip_mm), -1, dtype=np.int64)
        s = np.array([task.polyps[k].s_mm for k in left])
        found: IntArray = left[np.abs(s - tip_mm[:, None] - REFERENCE_MM).argmin(axis=1)]
        return found

    def _seen(
        self, camera: Array, t: float, targets: Array, sight: Sight, near: IntArray
    ) -> tuple[int | None, Aim | None]:
        """The polyp that is viewed, and how."""
        best: tuple[int | None, Aim | None] = None, None
        for index in near.tolist():
            if self.viewings[index].cleared_t is not None:
                continue
            aim, again = aim_at(camera, targets[index]), self.viewed and index == self.target
            better = again or best[1] is None or aim.accuracy > best[1].accuracy
            if aim.within and better and sight(camera[:3, 3], index, t):
                best = index, aim
                if again:
                    break
        return best

    def _after(self, seen: int | None, aim: Aim | None, t: float, hold_s: float) -> tuple[Viewing, ...]:
        """The viewings after a step at whose end the polyp ``seen`` is viewed, None: none is."""
        viewings, before = list(self.viewings), self.target if self.viewed else None
        if before is not None and before != seen and viewings[before].cleared_t is None:
            was = viewings[before]
            viewings[before] = was._replace(held_s=0.0, lost=was.lost + 1)
        if seen is not None and seen == before and aim is not None:
            was, dt = viewings[seen], t - self.t
            held = was.held_s + dt
            viewings[seen] = was._replace(
                held_s=held,
                viewed_s=was.viewed_s + dt,
                distance_mm_s=was.distance_mm_s + aim.distance_error_mm * dt,
                angle_deg_s=was.angle_deg_s + aim.angle_deg * dt,
                cleared_t=t if held >= hold_s - _SAME_S else None,
            )
        return tuple(viewings)
