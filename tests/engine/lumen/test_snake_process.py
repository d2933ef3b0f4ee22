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
from snake_runs import SAME_MM, wall_that_gives_way

from vfix_engine.lumen.system import SnakeSnapshot
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.run import Run
from vfix_engine.runtime.virtual_coupling import GONE_S

Process = ControlProcess[SnakeSnapshot]
LATE_STEPS = 40  # the last snapshot before the hand was lost may be that old


def until(process: Process, wanted: Callable[[SnakeSnapshot], bool], axes: tuple[float, float, float]) -> SnakeSnapshot:
    """Drive by heartbeats until a snapshot is as wanted."""
    deadline = time.monotonic() + 60.0
    process.axes(*axes)
    while time.monotonic() < deadline:
        process.heartbeat()
        if process.hand_lost:  # a machine that was busy for too long
            process.axes(*axes)
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.01)
    raise AssertionError(f"it did not come to that; the last was {process.snapshot()}")


def in_a_process_of_its_own(*words: Path) -> str:
    """What snake_replay.py prints."""
    here = Path(__file__).resolve()
    paths = os.pathsep.join(map(str, (here.parents[3], here.parent)))
    command = [sys.executable, str(here.with_name("snake_replay.py")), *map(str, words)]
    environment = os.environ | {"PYTHONPATH": paths}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=600).stdout


def held_at_the_wall(snapshot: SnakeSnapshot) -> bool:
    return snapshot.outcome == "held" and any(one.kind == "bound" for one in snapshot.blockers)


def test_driven_by_heartbeats_in_a_lumen_that_moves(tmp_path: Path) -> None:
    """HAZ-11: pushed to the wall, on as the wall goes, stopped when the hand is lost; judged again from its record."""
    in_a_process_of_its_own()  # compiles
    process: Process = ControlProcess(wall_that_gives_way(), real_time=False, record=tmp_path / "snake.run")
    try:
        process.start()
        process.wait_ready(300.0)
        process.run()
        until(process, lambda s: s.progress_mm > 152.0, (0.0, 0.0, 1.0))
        wall = until(process, held_at_the_wall, (0.5, 0.0, 0.0))
        until(process, lambda s: s.bend > wall.bend + 0.02, (0.5, 0.0, 0.0))
        beat = process.snapshot()  # and no heartbeat more
        time.sleep(1.0)
        assert process.hand_lost
    finally:
        process.close()
    assert beat is not None
    run = Run.read(tmp_path / "snake.run")
    assert run.lost == 0
    axes = np.array([run.command(index).axes for index in range(len(run.ticks))])
    pushed = int(np.flatnonzero(axes.any(axis=1))[-1])
    assert beat.steps <= pushed <= beat.steps + 1e3 * GONE_S + LATE_STEPS
    steering = np.column_stack([run.column("u"), run.column("v")])
    assert len(steering) > pushed + 100  # the tissue moves on, and the clock with it
    assert (steering[pushed:] == steering[-1]).all()
    again = json.loads(in_a_process_of_its_own(tmp_path / "snake.run"))
    assert again["first_difference"] is None, again
    assert (again["violations"], again["disagreements"]) == (0, 0)
    assert again["deepest_mm"] < SAME_MM
