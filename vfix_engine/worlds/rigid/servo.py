"""An ideal position servo between the set points of a slower outer loop (Li 2007, V.A: 30 Hz over about 1 kHz)."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...control import Controller

SERVO_HZ = 1000.0


def servo_poses(before: Array, after: Array, period_s: float, rate_hz: float = SERVO_HZ) -> Array:
    """Joints (k, n) at the servo's ticks within one period, the last of them ``after`` (n,), straight in joint space.

    The certificate of the outer step covers this motion at every instant, so also at these.
    """
    ticks = max(1, round(period_s * rate_hz))
    shares = np.arange(1, ticks + 1)[:, None] / ticks
    poses: Array = before + shares * (after - before)
    poses[-1] = after
    return poses


class ServoWatch:
    """Measures the tool again at every tick of the servo. ticks: so far; clearance_mm: the least bone clearance."""

    def __init__(self, rate_hz: float = SERVO_HZ) -> None:
        self.rate_hz, self.ticks, self.clearance_mm = rate_hz, 0, np.inf

    def watch(self, controller: Controller, before: Array, after: Array) -> None:
        """One period of the outer loop, from the joints ``before`` (n,) to ``after`` (n,)."""
        for q in servo_poses(before, after, controller.settings.dt_s, self.rate_hz):
            self.clearance_mm = min(self.clearance_mm, controller.measure(q).clearance)
            self.ticks += 1

    def report(self) -> dict[str, float | int | None]:
        """Rate, ticks and least clearance; None for a clearance of which nothing was measured."""
        least = self.clearance_mm if self.ticks else None
        return {"rate_hz": self.rate_hz, "ticks": self.ticks, "min_bone_clearance_mm": least}
