"""The fixed-rate clock: no burst after a stall, misses counted (HAZ-10)."""

import itertools

from vfix_engine.runtime.clock import FixedRateClock


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


def test_the_last_part_of_a_wait_is_spun() -> None:
    fake = FakeTime()
    looks = 0

    def look() -> float:
        nonlocal looks
        looks += 1
        fake.now += 1e-6  # a look takes its time
        return fake.now

    clock = FixedRateClock(0.001, look, fake.sleep, spin=0.0002)
    for _ in range(20):
        clock.wait()
        clock.worked()
    assert max(fake.slept) < 0.0008
    assert min(fake.slept) > 0.0006
    assert looks > 20 * 150
    timing = clock.timing()
    assert timing.lateness_us_p99 < 2.5
    assert round(timing.loop_hz) == 1000


def test_figures_of_the_last_ticks_and_of_all() -> None:
    """HAZ-10: lateness is published as median and 99 %, overruns are counted over everything."""
    fake = FakeTime()
    late = 0.0

    def sleep(seconds: float) -> None:
        fake.sleep(seconds + late)

    clock = FixedRateClock(0.001, fake.read, sleep)
    for tick in range(2500):
        late = 0.0002 if tick % 4 == 0 else 20e-6
        clock.wait()
        fake.now += 0.0003
        clock.worked()
    timing = clock.timing(at_once=True)
    assert abs(timing.lateness_us_p50 - 20) < 1
    assert abs(timing.lateness_us_p99 - 200) < 1
    assert abs(timing.step_us_p99 - 300) < 1
    assert abs(clock.busy_share - 0.3) < 0.001
    record = clock.record()
    assert record.ticks == 2500
    assert abs(record.seconds - 2.5) < 0.01
    assert abs(record.lateness_us["p50"] - 20) <= 1
    assert abs(record.lateness_us["p99"] - 200) <= 1
    assert record.overruns == 0
    clock.restart()
    assert clock.timing(at_once=True).loop_hz == 0
    assert clock.record().ticks == 2500


def test_figures_that_are_asked_for_during_any_tick_are_those_of_the_ticks_before() -> None:
    fake = FakeTime()
    clock = FixedRateClock(0.001, fake.read, fake.sleep)
    for tick in range(3100):
        clock.wait()
        if tick >= 2:
            timing = clock.timing(at_once=True)
            assert abs(timing.loop_hz - 1000) < 0.01, tick
            assert abs(timing.step_us - 100) < 0.01, tick
        fake.now += 0.0001
        clock.worked()


def test_figures_are_not_made_anew_at_every_look() -> None:
    fake = FakeTime()
    clock = FixedRateClock(0.001, fake.read, fake.sleep)
    for _ in range(600):
        clock.wait()
        clock.worked()
    first = clock.timing()
    clock.wait()
    fake.now += 0.0009
    clock.worked()
    assert clock.timing() is first
    fake.now += 0.5
    assert clock.timing() is not first
