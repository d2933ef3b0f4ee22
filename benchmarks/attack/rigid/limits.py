"""The judge of motion: checks a recording of joints for speed, acceleration, and the ability to stop (HAZ-06).

It uses independent formulas: it sums the steps of the hardest braking as an arithmetic series, and knows only joints,
clearances and the limits in the robot's file.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vfix_engine.arrays import Array

# Rounding of q (1e-14) gives an error of 1e-6 in an acceleration from two differences at 10 kHz.
ROUNDING = 1e-6
CLOSE_MM = 1e-3  # a smaller violation of the margin is tolerated (HAZ-01)


def braking_way(step: Array, change: Array) -> Array:
    """Return the distance travelled after a step if every further step is shorter by ``change`` > 0, in the same unit.

    The sum of step − change, step − 2 change, … as long as they are positive.
    """
    count = np.ceil(np.maximum(step, 0.0) / change) - 1.0
    count = np.maximum(count, 0.0)
    way: Array = count * np.maximum(step, 0.0) - change * count * (count + 1.0) / 2.0
    return way


@dataclass
class MotionJudge:
    """Judges one recording of a robot that began at rest, step by step.

    lower, upper, speed, acceleration (n,): of the robot's file. dt: period in s.
    margin_mm, deceleration_mm_per_s2: of the approach to anatomy. told_mm: clearances are exact up to this value.
    counts: violations by kind 'range', 'speed', 'acceleration', 'stop in range' and 'stop before the margin'.
    An emergency is exempt from the acceleration and from what follows from it in its own step, and is counted.
    """

    lower: Array
    upper: Array
    speed: Array
    acceleration: Array
    dt: float
    margin_mm: float = 0.0
    deceleration_mm_per_s2: float = np.inf
    told_mm: float = np.inf
    steps: int = 0
    emergencies: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    worst: dict[str, float] = field(default_factory=dict)
    _last: Array | None = None

    @property
    def violations(self) -> int:
        return sum(self.counts.values())

    def again(self) -> None:
        """Begin the next recording, at rest."""
        self._last = None

    def judge(
        self,
        before: Array,
        after: Array,
        emergency: bool = False,
        clearance: tuple[float, float] | None = None,
    ) -> bool:
        """Judge one step between two recorded q (n,); return whether it keeps all limits.

        clearance: clearances of the whole tool before and after the step in mm.
        """
        step = after - before
        last = np.zeros(len(step)) if self._last is None else self._last
        self._last = step
        self.steps += 1
        self.emergencies += emergency
        found = self.violations
        change = self.acceleration * self.dt**2
        bits = 1e-14 * np.maximum(np.abs(after), 1.0)
        self._note("range", np.maximum(self.lower - after, after - self.upper), 0.0 * bits)
        self._note("speed", np.abs(step) - self.speed * self.dt, ROUNDING * self.speed * self.dt + bits)
        if not emergency:
            self._note("acceleration", np.abs(step - last) - change, ROUNDING * change + 4 * bits)
            room = np.where(step > 0.0, self.upper - after, after - self.lower)
            way = braking_way(np.abs(step), change)
            self._note("stop in range", way - room, ROUNDING * (way + change) + bits)
            self._approach(clearance)
        return self.violations == found

    def _approach(self, clearance: tuple[float, float] | None) -> None:
        """Judge the whole tool's approach to anatomy: it must still be able to stop before the margin."""
        if clearance is None or clearance[0] >= self.told_mm:
            return
        nearer = np.array([clearance[0] - clearance[1]])
        way = braking_way(nearer, np.array([self.deceleration_mm_per_s2 * self.dt**2]))
        self._note("stop before the margin", way - (clearance[1] - self.margin_mm), np.array([CLOSE_MM]))

    def _note(self, kind: str, excess: Array, tolerance: Array) -> None:
        over = excess - tolerance
        if (over > 0.0).any():
            self.counts[kind] += 1
            self.worst[kind] = max(self.worst.get(kind, 0.0), float(excess.max()))

    def report(self) -> dict[str, Any]:
        """Return the figures as JSON values."""
        return {
            "steps": self.steps,
            "violations": self.violations,
            "by_kind": dict(self.counts),
            "worst": dict(self.worst),
            "emergencies": self.emergencies,
            "emergency_share": self.emergencies / max(self.steps, 1),
        }
