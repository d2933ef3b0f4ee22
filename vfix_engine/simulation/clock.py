"""A fixed-rate clock that never bursts after a stall and counts what it missed (HAZ-10)."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import numpy as np

from .snapshot import Timing

_STALL_S = 0.05  # a tick later than this is not caught up
_WINDOW = 1000  # ticks that the published figures look back on


class FixedRateClock:
    """Deadlines every ``period`` seconds; the clock and the sleep can be injected in tests."""

    def __init__(
        self,
        period: float,
        now: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self.period, self._now, self._sleep = period, now, sleep
        self._late: deque[float] = deque(maxlen=_WINDOW)
        self._busy: deque[float] = deque(maxlen=_WINDOW)
        self._ticks: deque[float] = deque(maxlen=_WINDOW)
        self._overruns = 0
        self._deadline = now()
        self._began = self._deadline

    def restart(self) -> None:
        """Begin a new stretch of ticks now; a pause is no lateness."""
        self._deadline = self._now()
        self._late.clear()
        self._busy.clear()
        self._ticks.clear()

    def wait(self) -> None:
        """Sleep until the next deadline; where it has passed, say so in the figures and go on from now."""
        self._deadline += self.period
        remaining = self._deadline - self._now()
        if remaining > 0:
            self._sleep(remaining)
        late = self._now() - self._deadline
        if late > self.period:
            self._overruns += 1
        if late > min(_STALL_S, 10 * self.period):
            self._deadline = self._now()
        self._late.append(late)
        self._began = self._now()
        self._ticks.append(self._began)

    def worked(self) -> None:
        """The work of this tick is done."""
        self._busy.append(self._now() - self._began)

    def timing(self) -> Timing:
        """Rate, step time and lateness over the last ticks."""
        if len(self._ticks) < 2 or not self._busy:
            return Timing(overruns=self._overruns)
        rate = (len(self._ticks) - 1) / max(self._ticks[-1] - self._ticks[0], 1e-9)
        busy = np.array(self._busy) * 1e6
        return Timing(
            loop_hz=float(rate),
            step_us=float(np.median(busy)),
            step_us_p99=float(np.percentile(busy, 99)),
            lateness_us_p99=float(np.percentile(np.array(self._late), 99) * 1e6),
            overruns=self._overruns,
        )
