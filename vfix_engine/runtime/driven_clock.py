"""Driven time of a world whose control period can be changed on the way."""

from __future__ import annotations

from typing import NamedTuple


class DrivenClock(NamedTuple):
    """The driven time in s after ``steps`` steps, where the present period began; before a change both are 0.

    The time since is a product, not a sum: a drive of one period has the same bits as if there were no clock.
    """

    at_s: float = 0.0
    steps: int = 0

    def read(self, steps: int, period_s: float) -> float:
        """Driven time in s after a number of steps from the start."""
        return self.at_s + (steps - self.steps) * period_s

    def changed(self, steps: int, period_s: float, new_period_s: float) -> DrivenClock:
        """The clock from a step on at which the period changes; itself where it stays."""
        return self if new_period_s == period_s else DrivenClock(self.read(steps, period_s), steps)


FROM_START = DrivenClock()
