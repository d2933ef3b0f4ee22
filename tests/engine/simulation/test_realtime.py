"""The control process: driven, watched, left alone, refused (HAZ-10, HAZ-11)."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from tests.engine.scenes import curved_tube, wall
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import Tool
from vfix_engine.simulation.events import Event
from vfix_engine.simulation.realtime import RehearsalProcess, SceneSpec
from vfix_engine.simulation.snapshot import Snapshot


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
    shared_process.events()
    until(shared_process, lambda s: s.progress_mm < 0.1 and not s.running)
    return shared_process


def until(process: RehearsalProcess, wanted: Callable[[Snapshot], bool], seconds: float = 10.0) -> Snapshot:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.005)
    raise AssertionError(f"not within {seconds} s; last was {process.snapshot()}")


def beat(process: RehearsalProcess, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        process.heartbeat()
        time.sleep(0.03)


def test_it_starts_paused_at_the_entry(process: RehearsalProcess) -> None:
    snapshot = process.snapshot()
    assert snapshot is not None
    assert snapshot.progress_mm == pytest.approx(0.0, abs=1e-6)
    process.drive(1)
    beat(process, 0.3)
    still = process.snapshot()
    assert still is not None
    assert still.progress_mm == pytest.approx(0.0, abs=1e-6)


def test_keys_drive_along_the_path_while_they_beat(process: RehearsalProcess) -> None:
    process.run()
    process.drive(1)
    beat(process, 1.0)
    moved = until(process, lambda s: s.progress_mm > 1.0)
    assert moved.running
    assert moved.tip_error_mm < 0.01
    assert moved.timing.loop_hz > 0
    assert moved.timing.step_us > 0


def test_a_still_hand_keeps_pushing_and_a_lost_one_stops_in_time(process: RehearsalProcess) -> None:
    """HAZ-11: the page dies mid-drag: standstill within 200 ms; a hand held still goes on."""
    process.run()
    start = process.snapshot()
    assert start is not None
    process.set_grip(start.grip + np.array([0.0, 30.0, 0.0]))
    beat(process, 1.2)
    first = until(process, lambda s: s.progress_mm > 3.0)
    assert np.linalg.norm(first.force) == pytest.approx(5.0)
    stands(process)  # not a word from now on
    beat(process, 0.3)
    process.pause()
    process.run()
    beat(process, 0.1)
    stands(process, 0.0)  # a late heartbeat takes no hold
    later = process.snapshot()
    assert later is not None
    process.set_grip(later.grip + np.array([0.0, 30.0, 0.0]))
    beat(process, 0.2)
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
    process.drive(1)
    beat(process, 0.3)
    until(process, lambda s: s.progress_mm > start.progress_mm + 0.5)


def stands(process: RehearsalProcess, after: float = 0.2) -> None:
    """After so many seconds the tool stands, and without a force."""
    time.sleep(after)
    stopped = process.snapshot()
    time.sleep(0.4)
    later = process.snapshot()
    assert stopped is not None
    assert later is not None
    np.testing.assert_array_equal(later.q, stopped.q)
    assert not later.force.any()


def test_release_lets_the_force_go(process: RehearsalProcess) -> None:
    process.run()
    start = process.snapshot()
    assert start is not None
    process.set_grip(start.grip + np.array([0.0, 30.0, 0.0]))
    beat(process, 0.4)
    process.release()
    time.sleep(0.2)
    one = process.snapshot()
    time.sleep(0.2)
    two = process.snapshot()
    assert one is not None
    assert two is not None
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
    deadline = time.monotonic() + 5
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


def test_a_killed_process_is_told_of() -> None:
    process = RehearsalProcess(spec_of(*curved_tube()), ControlSettings())
    process.start()
    process.wait_ready(60.0)
    process._process.kill()
    process._process.join()
    assert not process.alive
    assert any(event.kind == "failed" for event in process.events())
    process.close()
