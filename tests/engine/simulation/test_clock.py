"""The fixed-rate clock: no burst after a stall, misses counted (HAZ-10)."""

import itertools

from vfix_engine.simulation.clock import FixedRateClock


class FakeTime:
    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []

    def read(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


def test_ticks_are_even() -> None:
    fake = FakeTime()
    clock = FixedRateClock(0.001, fake.read, fake.sleep)
    for _ in range(50):
        clock.wait()
        fake.now += 0.0004
        clock.worked()
    timing = clock.timing()
    assert round(timing.loop_hz) == 1000
    assert round(timing.step_us) == 400
    assert timing.overruns == 0


def test_a_stall_is_counted_and_not_caught_up() -> None:
    fake = FakeTime()
    clock = FixedRateClock(0.001, fake.read, fake.sleep)
    clock.wait()
    fake.now += 0.5
    clock.worked()
    ticks = []
    for _ in range(5):
        clock.wait()
        ticks.append(fake.now)
        clock.worked()
    assert clock.timing().overruns == 1
    gaps = [b - a for a, b in itertools.pairwise(ticks)]
    assert min(gaps) > 0.0009  # no burst


def test_a_pause_is_no_lateness() -> None:
    fake = FakeTime()
    clock = FixedRateClock(0.001, fake.read, fake.sleep)
    clock.wait()
    clock.worked()
    fake.now += 30.0
    clock.restart()
    clock.wait()
    clock.worked()
    assert clock.timing().overruns == 0
