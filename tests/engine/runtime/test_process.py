"""The control process of any world: its worker, its recorder, its axes (HAZ-11, HAZ-13, HAZ-26)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest

from tests.engine.tiny import Jump, TinySettings, TinySnapshot, TinySpec, TinySystem
from vfix_engine.errors import ControlError
from vfix_engine.runtime import Note, SetSettings, Straighten
from vfix_engine.runtime.command import COMMAND_SIZE, command_from_row
from vfix_engine.runtime.events import Event
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.runtime.system import Worker

Process = ControlProcess[TinySnapshot]


@pytest.fixture
def process(tmp_path: Path) -> Iterator[Process]:
    one: Process = ControlProcess(TinySpec(), real_time=False, record=tmp_path / "drive.run")
    one.start()
    one.wait_ready(60.0)
    one.run()
    yield one
    one.close()


def until(process: Process, wanted: Callable[[TinySnapshot], bool], sign: Callable[[], None]) -> TinySnapshot:
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        sign()
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.02)
    raise AssertionError(f"it did not come to that; the last was {process.snapshot()}")


def signs(process: Process, count: int) -> TinySnapshot:
    """The snapshot after so many signs of life from now on: the loop had its time, however busy the machine is."""
    for _ in range(count):
        process.snapshot()
        seen = process._seen
        until(process, lambda _, seen=seen: process._seen != seen, lambda: None)
    last = process.snapshot()
    assert last is not None
    return last


def at_rest(process: Process) -> TinySnapshot:
    """The snapshot from which on no step is made."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        before = process.snapshot()
        time.sleep(0.3)
        after = signs(process, 3)
        if before is not None and before.steps == after.steps:
            return after
    raise AssertionError(f"it does not come to rest; the last was {process.snapshot()}")


def test_a_drive_with_its_worker_is_recorded_and_driven_again(process: Process, tmp_path: Path) -> None:
    until(process, lambda s: s.half > 0.0, lambda: process.drive(1))
    process.apply(Jump(3.0))
    process.apply(Straighten())  # which this world refuses
    process.apply(SetSettings(TinySettings(2.0, 0.001)))
    until(process, lambda s: s.half > 1.0, lambda: process.axes(0.0, 0.0, 1.0))
    process.release()
    last = at_rest(process)
    assert any(event.kind == "note" and "Straighten" in event.text for event in process.events())
    process.close()
    run = Run.read(tmp_path / "drive.run")
    assert run.whole
    assert run.lost == 0
    assert len(run.ticks) == last.steps
    assert run.column("x")[-1] == last.q[0]
    kinds = [event.kind for event in run.events]
    assert kinds.count("request") == 2
    workers = {event.content["result"]["process"] for event in run.events if event.kind == "adopt"}
    assert len(workers) == 1, "one worker process for the whole drive"
    assert replay(run, TinySpec()).same


def test_a_disk_that_is_full_is_told_once_and_stops_no_tick(process: Process, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-13: a drive that leaves no run says so while it goes on."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RunWriter, "ticks", full)
    first = until(process, lambda s: s.steps > 20, lambda: process.drive(1))
    assert process._recorder is not None
    process._recorder.thread.join(60.0)
    told = [event.text for event in [*process.events(), *process.events()] if event.kind == "unrecorded"]
    assert told == ["the run cannot be written: No space left on device"]
    until(process, lambda s: s.steps > first.steps + 20, lambda: process.drive(1))


def test_time_goes_on_at_rest_once_a_timed_note_is_made_and_stands_when_paused(process: Process) -> None:
    before = at_rest(process).steps
    process.apply(Note("diary", {"word": "nothing is timed"}))
    assert at_rest(process).steps == before
    process.apply(Note("task", {}, timed=True))
    until(process, lambda s: s.steps > before + 20, lambda: None)
    process.pause()
    paused = at_rest(process).steps
    process.run()
    until(process, lambda s: s.steps > paused + 20, lambda: None)
    process.reset()
    process.run()
    at_rest(process)


def test_axes_fade_when_nobody_is_heard_of(process: Process) -> None:
    """HAZ-11: the dead man's switch is the loop's, whatever the world."""
    until(process, lambda s: s.progress_mm > 1e-3, lambda: process.axes(0.0, 0.0, 0.5))
    two = at_rest(process)
    assert process.hand_lost
    process.axes(np.nan, 0.0, 0.0)
    time.sleep(0.1)
    three = signs(process, 2)
    assert three.steps == two.steps, "no number pushes nothing"


def test_the_last_step_says_that_a_button_is_held_no_more(process: Process, tmp_path: Path) -> None:
    """Whoever reads the steps knows it then, also where nothing moves any more."""
    until(process, lambda s: s.steps > 20, lambda: process.axes(0.0, 0.0, 0.0, buttons=1))
    process.axes(0.0, 0.0, 0.0)
    at_rest(process)
    process.close()
    held = [command_from_row(row[:COMMAND_SIZE]).buttons for row in Run.read(tmp_path / "drive.run").ticks]
    assert held[0] == 1
    assert held[-1] == 0
    assert held.count(0) == np.count_nonzero(np.diff(held) < 0), "one step without it after each hold"


def test_a_worker_that_dies_stops_no_tick(process: Process) -> None:
    process.apply(Jump(-200.0))
    first = until(process, lambda s: s.progress_mm < -100.0 and s.steps > 200, lambda: process.drive(1))
    assert process._worker is not None
    process._worker.join(60.0)
    assert process._worker.exitcode == 3
    later = until(process, lambda s: s.steps > first.steps + 50, lambda: process.drive(1))
    assert later.q[0] > first.q[0]
    notes: list[str] = []

    def listen() -> None:
        process.heartbeat()
        notes.extend(event.text for event in process.events() if event.kind == "note")

    until(process, lambda _: any("worker process ended" in text for text in notes), listen)


@dataclass(frozen=True)
class SlowlyMadeSpec(TinySpec):
    """Its worker leaves a file when it has been built, long after the system."""

    file: str = ""

    def worker(self) -> Worker:
        time.sleep(1.5)
        Path(self.file).touch()
        return super().worker()


def test_a_drive_is_ready_when_its_worker_is(tmp_path: Path) -> None:
    """What a motion waits for is planned at once: nobody presses a key for seconds in vain."""
    made = tmp_path / "made"
    one: Process = ControlProcess(SlowlyMadeSpec(file=str(made)), real_time=False)
    try:
        one.start()
        one.wait_ready(60.0)
        assert made.exists()
    finally:
        one.close()


@dataclass(frozen=True)
class NeverMadeSpec(TinySpec):
    """Its worker cannot be built."""

    def worker(self) -> Worker:
        raise ValueError("no worker")


def test_a_drive_whose_worker_cannot_be_made_goes_on_and_says_so() -> None:
    one: Process = ControlProcess(NeverMadeSpec(), real_time=False)
    notes: list[str] = []

    def listen() -> None:
        one.drive(1)
        notes.extend(event.text for event in one.events() if event.kind == "note")

    try:
        one.start()
        one.wait_ready(60.0)
        one.run()
        until(one, lambda s: s.steps > 50 and bool(notes), listen)
        assert notes == ["the worker process failed (ValueError: no worker); it goes on without its results"]
    finally:
        one.close()


def test_work_that_fails_once_is_told_and_the_next_piece_is_done(process: Process) -> None:
    process.apply(Jump(-60.0))
    notes: list[str] = []

    def listen() -> None:
        process.drive(1)
        notes.extend(event.text for event in process.events() if event.kind == "note")

    until(process, lambda _: bool(notes), listen)
    assert notes == [
        "background work failed (ValueError: too low); its result is missing, and the next one is asked for"
    ]
    process.apply(Jump(3.0))
    until(process, lambda s: s.half > 1.0, listen)
    assert process._worker is not None
    assert process._worker.is_alive()
    assert len(notes) == 1, "each trouble once"


def test_every_step_is_read_at_control_rate() -> None:
    """1 kHz for two seconds, read at 100 Hz by two readers: no step is missing, and nobody records."""
    process: Process = ControlProcess(TinySpec(), real_time=False)
    try:
        with pytest.raises(ControlError, match="wait until"):
            process.rows()
        process.start()
        process.wait_ready(60.0)
        process.apply(SetSettings(TinySettings(1.0, 0.001)))
        process.run()
        reader, batches, other = process.rows(), [], []
        late = process.rows()
        begin, driven = time.monotonic(), 0
        # a busy machine drives more slowly, and leaves no step out
        while time.monotonic() < begin + 2.0 or (driven <= 600 and time.monotonic() < begin + 60.0):
            process.axes(0.0, 0.0, 1.0)
            time.sleep(0.01)
            batches.append(reader.read())
            driven += len(batches[-1])
            if len(batches) % 20 == 0:
                other.append(late.read())
        process.release()
        until(process, lambda s: s.outcome == "idle", lambda: None)
        at_rest(process)
        rows = np.concatenate([*batches, reader.read()])
        assert np.array_equal(np.concatenate([*other, late.read()]), rows)
        names = [column.name for column in reader.columns]
        assert names[-4:] == ["t", "x", "half", "half_age"]
        steps = np.round(rows[:, names.index("t")] / 0.001).astype(int)
        assert (np.diff(steps) == 1).all()
        assert len(steps) > 500
        assert rows[:, names.index("insert")].max() == 1.0
        last = process.snapshot()
        assert last is not None
        assert (last.steps, last.q[0]) == (steps[-1], rows[-1, names.index("x")])
        assert reader.lost == late.lost == 0
        assert not reader.ended
    finally:
        process.close()
    assert reader.ended
    with pytest.raises(ControlError, match="closed"):
        process.rows()


class Slow(Process):
    """A process that is not started: what it says comes from a script, a second after the other."""

    def __init__(self, said: list[Event | None]) -> None:
        super().__init__(TinySpec(), real_time=False)
        self.script, self.clock = said, 0.0

    @property
    def alive(self) -> bool:
        return bool(self.script)

    def _said(self) -> list[Event]:
        self.clock += 1.0
        event = self.script.pop(0)
        return [] if event is None else [event]


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[list[Event | None]], Slow]]:
    made: list[Slow] = []

    def begin(said: list[Event | None]) -> Slow:
        made.append(Slow(said))
        monkeypatch.setattr(
            "vfix_engine.runtime.process.time", SimpleNamespace(monotonic=lambda: made[-1].clock, sleep=lambda _: None)
        )
        return made[-1]

    yield begin
    monkeypatch.undo()
    for one in made:
        one.close()


def test_a_process_that_compiles_is_waited_for_as_long_as_it_is_heard_of(
    slow: Callable[[list[Event | None]], Slow],
) -> None:
    """A kernel takes 9 s here and all of them 180 s: far more than the 10 s of silence that are borne."""
    said: list[Event | None] = []
    for kernel in range(20):
        said += [None] * 8 + [Event("compiled", str(kernel + 1))]
    heard: list[int] = []
    slow([*said, Event("ready")]).wait_ready(10.0, heard.append)
    assert heard == list(range(1, 21))


def test_a_process_that_is_silent_is_waited_for_no_longer(slow: Callable[[list[Event | None]], Slow]) -> None:
    with pytest.raises(ControlError, match="said nothing for 10 s"):
        slow([Event("compiled", "1"), *[None] * 30]).wait_ready(10.0)


@dataclass(frozen=True, eq=False)
class CompilingSpec(TinySpec):
    """The smallest world, which compiles two kernels before it is there."""

    def build(self) -> TinySystem:
        for add in (lambda x: x + 1.0, lambda x: x - 1.0):
            numba.njit(add)(1.0)
        return super().build()


def test_kernels_that_a_start_compiles_are_told() -> None:
    process: Process = ControlProcess(CompilingSpec(), real_time=False)
    heard: list[int] = []
    try:
        process.start()
        process.wait_ready(60.0, heard.append)
    finally:
        process.close()
    assert heard == sorted(heard)
    assert heard[-1] >= 2
