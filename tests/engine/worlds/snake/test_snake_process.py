"""The snake in the runtime's control process: heartbeats, a wall that moves, a hand that is lost, and its record."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from snake_runs import SAME_MM, made_spec, wall_that_gives_way

from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.run import Run
from vfix_engine.runtime.virtual_coupling import GONE_S
from vfix_engine.worlds.snake import LookRound, SnakeSnapshot
from vfix_engine.worlds.snake.stepping.tissue import OLDEST_S
from vfix_engine.worlds.snake.system import STILL_N

Process = ControlProcess[SnakeSnapshot]
PUSH = (0.5, 0.0, 0.0)
LATE_STEPS = 40  # the last snapshot before the hand was lost may be that old


def until(
    process: Process,
    wanted: Callable[[SnakeSnapshot], bool],
    axes: tuple[float, float, float],
    buttons: int = 0,
    seconds: float = 60.0,
) -> SnakeSnapshot:
    """Drive by heartbeats until a snapshot is as wanted."""
    deadline = time.monotonic() + seconds
    process.axes(*axes, buttons)
    while time.monotonic() < deadline:
        process.heartbeat()
        if process.hand_lost:  # a machine that was busy for too long
            process.axes(*axes, buttons)
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.01)
    raise AssertionError(f"it did not come to that; the last was {process.snapshot()}")


def later(process: Process, wanted: Callable[[SnakeSnapshot], bool]) -> SnakeSnapshot:
    """The first snapshot that is as wanted, with no sign of a hand meanwhile."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.01)
    raise AssertionError(f"it did not come to that; the last was {process.snapshot()}")


def signs(process: Process, count: int) -> SnakeSnapshot:
    """The snapshot after so many signs of life from now on: the loop had its time, however busy the machine is."""
    for _ in range(count):
        process.snapshot()
        seen = process._seen
        later(process, lambda _, seen=seen: process._seen != seen)
    last = process.snapshot()
    assert last is not None
    return last


def in_a_process_of_its_own(*words: Path) -> str:
    """What snake_replay.py prints."""
    here = Path(__file__).resolve()
    paths = os.pathsep.join(map(str, (here.parents[4], here.parents[2])))
    command = [sys.executable, str(here.parents[2] / "snake_replay.py"), *map(str, words)]
    environment = os.environ | {"PYTHONPATH": paths}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=600).stdout


def test_driven_by_heartbeats_in_a_lumen_that_moves(tmp_path: Path) -> None:
    """HAZ-11: pushed against what holds it, stopped when the hand is lost; measured again from its record.

    That a wall which gives way lets it go on is tested in simulated time, in test_snake_system.py.
    """
    in_a_process_of_its_own()  # compiles
    process: Process = ControlProcess(wall_that_gives_way(), real_time=False, record=tmp_path / "snake.run")
    try:
        process.start()
        process.wait_ready(300.0)
        process.run()
        until(process, lambda s: s.progress_mm > 152.0, (0.0, 0.0, 1.0))
        until(process, lambda s: s.bend > 0.2 and s.outcome == "held", PUSH)
        before = process.snapshot()
        process.axes(*PUSH)  # and no sign of the hand more
        after = process.snapshot()
        assert before is not None
        assert after is not None
        time.sleep(1.0)
        assert process.hand_lost
        gone = after.steps + 1e3 * GONE_S + LATE_STEPS
        later(process, lambda s: s.steps > gone + 100)  # the tissue moves on, and the clock with it
    finally:
        process.close()
    run = Run.read(tmp_path / "snake.run")
    assert run.lost == 0
    axes = np.array([run.command(index).axes for index in range(len(run.ticks))])
    pushed = int(np.flatnonzero(axes.any(axis=1))[-1])
    assert before.steps <= pushed <= gone
    steering = np.column_stack([run.column("u"), run.column("v")])
    assert len(steering) > pushed + 100
    assert (steering[pushed:] == steering[-1]).all()
    again = json.loads(in_a_process_of_its_own(tmp_path / "snake.run"))
    assert again["first_difference"] is None, again
    assert (again["violations"], again["disagreements"]) == (0, 0)
    if run.column("tissue_age").max() <= OLDEST_S:  # on a busy machine the wall may close in on a snake that stands
        assert again["deepest_mm"] < SAME_MM


def test_a_look_round_in_the_process_and_a_pause_in_the_middle_of_it() -> None:
    """Paused, a snake rests whatever it was doing: no step, no force that grows; it goes on where it was."""
    process: Process = ControlProcess(made_spec(), real_time=False)
    try:
        process.start()
        process.wait_ready(300.0)
        process.run()
        process.apply(LookRound(6.0))
        until(process, lambda s: s.doing == "look" and s.looked_deg.max() > 0.0, (0.0, 0.0, 0.0))
        process.pause()
        paused = until(process, lambda s: not s.running, (0.0, 0.0, 0.0))
        process.axes(1.0, 0.0, 0.0)  # somebody pushes nevertheless
        time.sleep(0.3)
        still = signs(process, 2)
        assert (still.steps, still.doing) == (paused.steps, "look")
        process.release()
        time.sleep(0.2)
        process.run()
        seen = until(process, lambda s: s.running and not s.doing, (0.0, 0.0, 0.0))
        assert (seen.looked_deg > 4.0).all()
        assert seen.straight
        time.sleep(0.3)
        rested = signs(process, 3)
        time.sleep(0.3)
        last = signs(process, 2)
        assert last.steps == rested.steps, "nothing is left to do"
        assert np.abs(last.forces).max() < STILL_N
    finally:
        process.close()
