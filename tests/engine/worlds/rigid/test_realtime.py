"""The control process: driven, watched, left alone, refused (HAZ-10, HAZ-11)."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

import numpy as np
import pytest

from tests.engine.scenes import curved_tube, wall
from tests.locks import Beside
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import Tool
from vfix_engine.runtime.events import Event
from vfix_engine.runtime.mailbox import Mailbox
from vfix_engine.runtime.requests import SetTask
from vfix_engine.worlds.rigid.realtime import RehearsalProcess, SceneSpec
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot


def spec_of(mesh: TriangleMesh, points: np.ndarray) -> SceneSpec:
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange  # the tip stands at the origin
    return SceneSpec(
        mesh.vertices, mesh.faces, "steady_hand", "bent_30", base, np.zeros(7), points, points[-1:], ("end",)
    )


@pytest.fixture(scope="module")
def shared_process() -> Iterator[RehearsalProcess]:
    process = RehearsalProcess(spec_of(*curved_tube(radius=4.0)), ControlSettings())
    process.start()
    process.wait_ready(120.0)
    yield process
    process.close()
    assert not process.alive


@pytest.fixture
def process(shared_process: RehearsalProcess) -> RehearsalProcess:
    shared_process.release()
    shared_process.set_settings(ControlSettings())
    shared_process.reset()
    until(shared_process, lambda s: s.progress_mm < 0.1 and not s.running)
    record(shared_process)  # all that was asked for before is answered then
    return shared_process


def until(process: RehearsalProcess, wanted: Callable[[RigidSnapshot], bool], seconds: float = 60.0) -> RigidSnapshot:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.005)
    raise AssertionError(f"not within {seconds} s; last was {process.snapshot()}")


def beat(process: RehearsalProcess, seconds: float) -> bool:
    """Heartbeats every 30 ms; False when this test was itself held up so long that the hand counts as lost."""
    return repeat(process.heartbeat, seconds)


def repeat(sign: Callable[[], None], seconds: float) -> bool:
    """Signs of the hand, like ``beat``; presses instead of heartbeats also get over a test that is held up."""
    begin = last = time.monotonic()
    longest = 0.0
    while last < begin + seconds:
        sign()
        time.sleep(0.03)
        now = time.monotonic()
        last, longest = now, max(longest, now - last)
    return longest < 0.09


def repeat_until(
    process: RehearsalProcess, sign: Callable[[], None], wanted: Callable[[RigidSnapshot], bool]
) -> RigidSnapshot:
    """Signs of the hand until a snapshot is as wanted."""

    def seen(snapshot: RigidSnapshot) -> bool:
        sign()
        return wanted(snapshot)

    return until(process, seen)


def hold_still(process: RehearsalProcess, seconds: float) -> RigidSnapshot:
    """A hand that pulls the grip 30 mm forwards and stays; the snapshot at its beginning."""
    for _ in range(20):
        start = process.snapshot()
        assert start is not None
        process.set_grip(start.grip + np.array([0.0, 30.0, 0.0]))
        if beat(process, seconds):
            return start
    raise AssertionError("this machine is too busy for a hand that beats every 30 ms")


def test_it_starts_paused_at_the_entry(process: RehearsalProcess) -> None:
    snapshot = process.snapshot()
    assert snapshot is not None
    assert snapshot.progress_mm == pytest.approx(0.0, abs=1e-6)
    process.drive(1)
    beat(process, 0.3)
    still = process.snapshot()
    assert still is not None
    assert still.progress_mm == pytest.approx(0.0, abs=1e-6)


def test_keys_drive_along_the_path(process: RehearsalProcess) -> None:
    """HAZ-10: every tick is one step of one period, and none comes before its time."""
    before = record(process)
    process.run()
    repeat(lambda: process.drive(1), 1.0)
    moved = repeat_until(process, lambda: process.drive(1), lambda s: s.progress_mm > 1.0)
    assert moved.running
    assert moved.tip_error_mm < 0.01
    process.release()
    stands(process)
    after, still = record(process), process.snapshot()
    assert still is not None
    ticks, seconds = after["ticks"] - before["ticks"], after["seconds"] - before["seconds"]
    assert ticks == still.steps
    assert still.t == pytest.approx(1e-3 * ticks)
    assert ticks <= 1000.0 * seconds + 100  # 10 ms of lateness are caught up
    assert 0 <= after["overruns"] - before["overruns"] <= ticks
    timing = still.timing
    assert timing.loop_hz > 0.0
    assert 0.0 < timing.step_us <= timing.step_us_p99
    assert timing.lateness_us_p50 <= timing.lateness_us_p99


def record(process: RehearsalProcess) -> dict[str, Any]:
    """The clock's record, asked for at rest."""
    process.ask_record()
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        for event in process.events():
            if event.kind == "record":
                return dict(json.loads(event.text))
        time.sleep(0.01)
    raise AssertionError("no record")


def test_a_still_hand_keeps_pushing_and_a_lost_one_stops_in_time(process: RehearsalProcess) -> None:
    """HAZ-11: the page dies mid-drag: standstill within 200 ms; a hand held still goes on."""
    process.run()
    start = hold_still(process, 0.8)
    grip = start.grip + np.array([0.0, 30.0, 0.0])
    whole = pytest.approx(5.0)  # while signs of the hand come in time; a late one lets the force fade for a moment
    pushed = start.progress_mm + 3.0
    repeat_until(
        process,
        lambda: process.set_grip(grip),
        lambda s: s.progress_mm > pushed and np.linalg.norm(s.force) == whole,
    )
    stands(process)  # not a word from now on
    beat(process, 0.3)
    process.pause()
    process.run()
    beat(process, 0.1)
    stands(process, 0.0)  # a late heartbeat takes no hold
    later = process.snapshot()
    assert later is not None
    hold_still(process, 0.2)
    until(process, lambda s: s.progress_mm > later.progress_mm + 0.2)


def test_keys_that_were_lost_are_pressed_anew(process: RehearsalProcess) -> None:
    """HAZ-11: the heartbeats of a page that answers again move nothing, a key that comes up neither."""
    process.run()
    process.twist(1)
    process.drive(1)
    beat(process, 0.4)
    stands(process)
    process.twist(0)
    beat(process, 0.3)
    stands(process, 0.0)
    start = process.snapshot()
    assert start is not None
    repeat_until(process, lambda: process.drive(1), lambda s: s.progress_mm > start.progress_mm + 0.5)


def stands(process: RehearsalProcess, after: float = 0.2) -> None:
    """After so many seconds the tool stands, and without a force."""
    time.sleep(after)
    stopped = signs(process, 3)
    time.sleep(0.4)
    later = signs(process, 1)
    np.testing.assert_array_equal(later.q, stopped.q)
    assert not later.force.any()


def signs(process: RehearsalProcess, count: int) -> RigidSnapshot:
    """The snapshot after so many signs of life from now on: the loop had its time, however busy the machine is."""
    for _ in range(count):
        process.snapshot()
        seen = process._seen
        until(process, lambda _, seen=seen: process._seen != seen)
    last = process.snapshot()
    assert last is not None
    return last


def test_release_lets_the_force_go(process: RehearsalProcess) -> None:
    process.run()
    hold_still(process, 0.3)
    process.release()
    time.sleep(0.2)
    one = signs(process, 3)
    time.sleep(0.2)
    two = signs(process, 1)
    np.testing.assert_array_equal(one.q, two.q)


def test_nonsense_grips_are_ignored(process: RehearsalProcess) -> None:
    """HAZ-05."""
    process.run()
    for bad in ([np.nan, 0, 0], [np.inf, 0, 0], [1e12, 0, 0], [1, 2]):
        process.set_grip(bad)
    beat(process, 0.3)
    snapshot = process.snapshot()
    assert snapshot is not None
    assert snapshot.progress_mm == pytest.approx(0.0, abs=1e-6)
    assert process.alive


def test_modes_settings_and_what_cannot_be_done(process: RehearsalProcess) -> None:
    process.set_mode("inspect", 7)
    process.set_mode("inspect", 0)
    until(process, lambda s: s.mode == "inspect" and s.phase == "inspect_approach")
    notes = [event.text for event in process.events()]
    assert any("no target number 8" in text for text in notes)
    process.set_settings(ControlSettings(margin_mm=0.7))
    until(process, lambda s: s.margin_mm == 0.7)
    process.set_settings(ControlSettings(margin_mm=3.0))  # the tube leaves 2.5 mm
    deadline = time.monotonic() + 60.0
    events: list[Event] = []
    while time.monotonic() < deadline and sum(event.kind == "settings" for event in events) < 2:
        events += process.events()
        time.sleep(0.01)
    assert any(event.kind == "note" and "less than the margin of 3 mm" in event.text for event in events)
    in_force = [json.loads(event.text)["margin_mm"] for event in events if event.kind == "settings"]
    assert in_force == [0.7, 0.7], "a refusal is answered with what is still in force"
    snapshot = process.snapshot()
    assert snapshot is not None
    assert snapshot.margin_mm == 0.7


def test_a_start_that_is_unsafe_is_refused_with_the_reason() -> None:
    """HAZ-04."""
    process = RehearsalProcess(spec_of(wall(0.9), np.array([[0.0, 0, 0], [0, 10, 0]])), ControlSettings())
    process.start()
    with pytest.raises(ControlError, match="mm from bone"):
        process.wait_ready(60.0)
    process.close()
    process.close()
    with pytest.raises(ControlError, match="closed"):
        process.run()


class _NoProcess:
    """Stands for the system's process: there once it was started, gone when it is killed."""

    pid: int | None = None

    def __init__(self, begun: Callable[[], None]) -> None:
        self._begun = begun

    def start(self) -> None:
        self.pid = 1
        self._begun()

    def is_alive(self) -> bool:
        return self.pid is not None and not self.killed

    killed = False

    def kill(self) -> None:
        self.killed = True

    def join(self, timeout: float | None = None) -> None:
        pass


def test_one_that_is_closed_is_not_started() -> None:
    process = RehearsalProcess(spec_of(*curved_tube()), ControlSettings())
    process.close()
    child = process._process = _NoProcess(lambda: None)  # type: ignore[assignment]
    with pytest.raises(ControlError, match="closed"):
        process.start()
    assert child.pid is None


def test_one_that_is_closed_while_it_starts_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    process = RehearsalProcess(spec_of(*curved_tube()), ControlSettings())
    closing = Beside(process.close)
    child = process._process = _NoProcess(closing.begin)  # type: ignore[assignment]
    monkeypatch.setattr(process, "_starting", closing, raising=False)
    process.start()
    closing.thread.join(60)
    assert child.killed
    assert not process.alive
    for mailbox in (process._out, process._in):
        with pytest.raises(FileNotFoundError):
            Mailbox.attach(mailbox.name)


@pytest.fixture
def own_process() -> Iterator[RehearsalProcess]:
    """One that may be stopped, broken and killed."""
    process = RehearsalProcess(spec_of(*curved_tube()), ControlSettings())
    process.start()
    process.wait_ready(60.0)
    yield process
    process.close()


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="needs a system that can stop a process")
def test_a_stopped_process_stops_nobody_else(own_process: RehearsalProcess) -> None:
    """HAZ-10: a caller would wait for ever, were any call waiting; what does not fit is refused in words."""
    until(own_process, lambda s: not s.running)
    assert own_process._process.pid is not None
    os.kill(own_process._process.pid, signal.SIGSTOP)

    def everything() -> None:
        own_process.set_grip([1.0, 2.0, 3.0])
        own_process.heartbeat()
        own_process.drive(1)
        own_process.release()
        own_process.snapshot()
        own_process.events()
        own_process.set_mode("inspect", 0)
        own_process.set_settings(ControlSettings())

    refusals: list[str] = []

    def call() -> None:
        try:
            for _ in range(5000):
                everything()
        except ControlError as error:
            refusals.append(str(error))

    caller = threading.Thread(target=call, daemon=True)
    caller.start()
    caller.join(60.0)
    assert not caller.is_alive(), "a call waits for the process"
    assert any("does not answer" in text for text in refusals)
    assert own_process.alive, "a stopped process has not ended"
    silence = own_process.silence_s
    time.sleep(0.3)
    assert own_process.silence_s >= silence + 0.3
    closer = threading.Thread(target=own_process.close, daemon=True)
    closer.start()
    own_process.snapshot()  # nor does anybody wait for whoever closes it
    closer.join(60.0)
    assert not closer.is_alive()
    assert not own_process.alive
    assert not own_process._process.is_alive()


def test_a_loop_at_rest_gives_signs_of_life(process: RehearsalProcess) -> None:
    process.snapshot()
    seen = process._seen
    until(process, lambda s: process._seen > seen + 2)


def test_answers_that_nobody_reads_stop_no_tick(process: RehearsalProcess) -> None:
    """HAZ-10: more answers than the pipe holds; the hand is obeyed meanwhile, and all of them are there later."""
    process.run()
    taken = list[int]()

    def flood() -> None:
        for number in count():
            process.set_settings(ControlSettings())
            taken.append(number)

    with pytest.raises(ControlError, match="nobody reads its events"):
        flood()
    repeat_until(process, lambda: process.drive(1), lambda s: s.progress_mm > 0.5)
    answered, deadline = 0, time.monotonic() + 60.0
    while answered < len(taken) and time.monotonic() < deadline:
        answered += sum(event.kind == "settings" for event in process.events())
        time.sleep(0.005)
    assert answered == len(taken)


def test_a_process_that_fails_says_why(own_process: RehearsalProcess) -> None:
    """Whatever it was: the last word comes before the end."""
    own_process.apply(SetTask("inspect", "none"))  # type: ignore[arg-type]
    own_process._process.join(60.0)
    kinds = [(event.kind, event.text) for event in own_process.events()]
    assert [kind for kind, _ in kinds] == ["failed", "failed"]
    assert "TypeError" in kinds[0][1]
    assert "ended" in kinds[1][1]
    assert own_process.events() == []
    with pytest.raises(ControlError, match="ended"):
        own_process.run()


def test_a_killed_process_is_told_of(own_process: RehearsalProcess) -> None:
    own_process._process.kill()
    own_process._process.join()
    assert not own_process.alive
    assert any(event.kind == "failed" for event in own_process.events())
