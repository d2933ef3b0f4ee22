"""A fixed-rate clock that never bursts after a stall and counts what it missed (HAZ-10)."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .snapshot import Timing

# The last part of a wait is spun away: a sleeping thread is woken 50 to 110 µs late, and a spinning one in time.
# Longer than those latenesses, and short enough to leave the processor to others most of the time.
SPIN_S = 150e-6

_STALL_S = 0.05  # a tick later than this is not caught up
_WINDOW = 1000  # ticks that the published figures look back on
_SLOTS = _WINDOW + 1  # they may be asked for during a tick, whose place must not be one of theirs
_PUBLISH_S = 0.5  # the published figures are made anew this often: nobody reads faster, and they cost 50 µs
_FINEST_US = 20_000  # latenesses and step times up to this are counted by the microsecond


@dataclass(frozen=True)
class Record:
    """All ticks since the clock was made: latenesses and step times in µs; overruns: ticks later than a period."""

    ticks: int
    seconds: float
    overruns: int
    lateness_us: dict[str, float]
    step_us: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


class FixedRateClock:
    """Deadlines every ``period`` seconds; the clock and the sleep can be injected in tests.

    spin: the last seconds of every wait in which the thread does not sleep but looks at the clock.
    """

    def __init__(
        self,
        period: float,
        now: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
        spin: float = 0.0,
    ):
        self.period, self._now, self._sleep, self._spin = period, now, sleep, spin
        self._late, self._busy, self._begun = np.zeros(_SLOTS), np.zeros(_SLOTS), np.zeros(_SLOTS)
        self._ticks = 0  # of this stretch
        self._overruns = 0
        self._all_late, self._all_busy = _Counts(), _Counts()
        self._seconds = 0.0
        self._deadline = self._began = now()
        self._published, self._published_at = Timing(), -np.inf

    def restart(self) -> None:
        """Begin a new stretch of ticks now; a pause is no lateness."""
        self._deadline = self._now()
        self._ticks = 0
        self._published, self._published_at = Timing(overruns=self._overruns), self._deadline

    def wait(self) -> None:
        """Sleep until the next deadline; where it has passed, say so in the figures and go on from now."""
        self._deadline += self.period
        remaining = self._deadline - self._now() - self._spin
        if remaining > 0:
            self._sleep(remaining)
        begin = self._now()
        while begin < self._deadline:
            begin = self._now()
        late = begin - self._deadline
        if late > self.period:
            self._overruns += 1
        if late > min(_STALL_S, 10 * self.period):
            self._deadline = begin
        place = self._ticks % _SLOTS
        if self._ticks:
            self._seconds += begin - self._began
        self._late[place] = late
        self._begun[place] = self._began = begin
        self._all_late.add(late)

    def worked(self) -> None:
        """The work of this tick is done."""
        busy = self._now() - self._began
        self._busy[self._ticks % _SLOTS] = busy
        self._all_busy.add(busy)
        self._ticks += 1

    @property
    def busy_share(self) -> float:
        """Share of the period that the median step takes, as published last."""
        return 1e-6 * self._published.step_us / self.period

    def timing(self, at_once: bool = False) -> Timing:
        """Rate, step time and lateness over the last ticks, at most half a second old unless asked for at once."""
        now = self._now()
        if at_once or now - self._published_at >= _PUBLISH_S:
            self._published, self._published_at = self._timing(), now
        return self._published

    def record(self) -> Record:
        """Every tick so far."""
        return Record(
            self._all_late.number, self._seconds, self._overruns, self._all_late.spread(), self._all_busy.spread()
        )

    def _timing(self) -> Timing:
        kept = min(self._ticks, _WINDOW)
        if kept < 2:
            return Timing(overruns=self._overruns)
        done = np.arange(self._ticks - kept, self._ticks) % _SLOTS
        late, busy = 1e6 * np.sort(self._late[done]), 1e6 * np.sort(self._busy[done])
        span = self._begun[done[-1]] - self._begun[done[0]]
        middle, last = kept // 2, min(int(np.ceil(0.99 * kept)), kept - 1)
        return Timing(
            loop_hz=float((kept - 1) / max(span, 1e-9)),
            step_us=float(busy[middle]),
            step_us_p99=float(busy[last]),
            lateness_us_p50=float(late[middle]),
            lateness_us_p99=float(late[last]),
            overruns=self._overruns,
        )


class _Counts:
    """How often each duration came, by the microsecond; what is longer is counted as the longest kept."""

    def __init__(self) -> None:
        self._counts = [0] * (_FINEST_US + 1)
        self._largest = 0.0
        self.number = 0

    def add(self, seconds: float) -> None:
        self._counts[min(max(int(1e6 * seconds), 0), _FINEST_US)] += 1
        self._largest = max(self._largest, seconds)
        self.number += 1

    def spread(self) -> dict[str, float]:
        """Median, 99th and 99.9th percentile and the largest, in µs."""
        below = np.cumsum(self._counts)
        shares = {"p50": 0.5, "p99": 0.99, "p99_9": 0.999}
        found = {name: float(np.searchsorted(below, share * self.number)) for name, share in shares.items()}
        return found | {"max": 1e6 * self._largest}
