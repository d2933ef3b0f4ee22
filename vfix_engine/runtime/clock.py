"""A fixed-rate clock that never catches up in bursts after a stall, and counts missed ticks (HAZ-10)."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .snapshot import Timing

# The last part of a wait is spent spinning: a sleeping thread wakes 50 to 110 µs late, a spinning one in time.
# Longer than that latency, and short enough to leave the processor free most of the time.
SPIN_S = 150e-6

_STALL_S = 0.05  # after a delay longer than this the missed ticks are skipped
_WINDOW = 1000  # ticks over which the published figures are computed
_SLOTS = _WINDOW + 1  # one more, because the figures can be requested during a tick, whose slot is incomplete
_PUBLISH_S = 0.5  # period of the published figures: no display reads them faster, and computing them takes 50 µs
_FINEST_US = 20_000  # latencies and step times up to this are counted with a resolution of 1 µs


@dataclass(frozen=True)
class Record:
    """Statistics of all ticks: latency and step time in µs; overruns: ticks that were late by more than a period."""

    ticks: int
    seconds: float
    overruns: int
    lateness_us: dict[str, float]
    step_us: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return asdict(self)


class FixedRateClock:
    """Deadlines every ``period`` seconds; tests can inject the clock and the sleep.

    spin: the last seconds of every wait are spent polling the clock instead of sleeping.
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
        self._ticks = 0  # since the last restart
        self._overruns = 0
        self._all_late, self._all_busy = _Counts(), _Counts()
        self._seconds = 0.0
        self._deadline = self._began = now()
        self._published, self._published_at = Timing(), -np.inf

    def restart(self) -> None:
        """Start a new sequence of ticks now, so that a pause does not count as latency."""
        self._deadline = self._now()
        self._ticks = 0
        self._published, self._published_at = Timing(overruns=self._overruns), self._deadline

    def wait(self) -> None:
        """Sleep until the next deadline; if it has passed, record the latency and continue from now."""
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
        """Mark the end of the work of this tick."""
        busy = self._now() - self._began
        self._busy[self._ticks % _SLOTS] = busy
        self._all_busy.add(busy)
        self._ticks += 1

    @property
    def busy_share(self) -> float:
        """Fraction of the period that the median step takes, as last published."""
        return 1e-6 * self._published.step_us / self.period

    def timing(self, at_once: bool = False) -> Timing:
        """Rate, step time and latency over the last ticks, at most half a second old unless requested ``at_once``."""
        now = self._now()
        if at_once or now - self._published_at >= _PUBLISH_S:
            self._published, self._published_at = self._timing(), now
        return self._published

    def record(self) -> Record:
        """Return statistics of all ticks so far."""
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
    """Histogram of durations with bins of 1 µs; longer ones are counted in the last bin."""

    def __init__(self) -> None:
        self._counts = [0] * (_FINEST_US + 1)
        self._largest = 0.0
        self.number = 0

    def add(self, seconds: float) -> None:
        self._counts[min(max(int(1e6 * seconds), 0), _FINEST_US)] += 1
        self._largest = max(self._largest, seconds)
        self.number += 1

    def spread(self) -> dict[str, float]:
        """Median, 99th and 99.9th percentile and maximum, in µs."""
        below = np.cumsum(self._counts)
        shares = {"p50": 0.5, "p99": 0.99, "p99_9": 0.999}
        found = {name: float(np.searchsorted(below, share * self.number)) for name, share in shares.items()}
        return found | {"max": 1e6 * self._largest}
