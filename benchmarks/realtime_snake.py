"""A snake in a breathing lumen in the control process: inserted, steered round, straightened, drawn back, and again.

The run is recorded, and the beginning of it driven again from the recording: the same rows to the last bit.
"""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vfix_engine.errors import ControlError
from vfix_engine.pathway.tissue_motion import breathing
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.command import BUTTON_STRAIGHTEN
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run
from vfix_engine.worlds.snake import LumenContours, SnakeSettings, SnakeSystemSpec
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.snapshot import SnakeSnapshot

BEAT_S = 0.02  # between two signs of the hand
ANSWER_S = 5.0
START_S = 600.0  # kernels that are not compiled yet
REPLAYED = 3000  # ticks that are driven again
LINKS = 8
BEND_MM, TURN_RAD, RADIUS_MM, CONTOURS = 130.0, 2.2, 13.0, 61
START_MM = 60.0
STRETCH_S = (1.5, 1.5, 0.5, 1.0)  # in, about, straight, back

Process = ControlProcess[SnakeSnapshot]


def spec() -> SnakeSystemSpec:
    """Eight links in a bend of 130 mm radius, 13 mm wide, which breathes by 4 mm."""
    turn = np.linspace(0.0, TURN_RAD, CONTOURS)
    centre = BEND_MM * np.column_stack([1.0 - np.cos(turn), np.zeros(CONTOURS), np.sin(turn)])
    lumen = LumenContours(centre, np.full((CONTOURS, 1), RADIUS_MM), CONTOURS)
    breath = breathing((0.0, 0.3, 1.0), 4.0, 4.0, 60.0)
    return SnakeSystemSpec(lumen, SnakeModel(LINKS), SnakeSettings(), DriveSettings(bends=4), breath, START_MM)


def measure(seconds: float, real_time: bool) -> dict[str, Any]:
    """Rate, lateness and step time of every tick, and whether the beginning of the run repeats."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "drive.run"
        process: Process = ControlProcess(spec(), real_time, file)
        try:
            process.start()
            process.wait_ready(START_S)
            process.run()
            told = _drive(process, seconds)
            told |= record(process)
        finally:
            process.close()
        run = Run.read(file)
    beyond, adopted = run.column("beyond_bound"), sum(event.kind == "adopt" for event in run.events)
    beginning = replace(run, ticks=run.ticks[:REPLAYED], events=tuple(e for e in run.events if e.at < REPLAYED))
    same = replay(beginning, spec()).same
    steps = np.diff(run.column("t")) / SnakeSettings().step_s
    # The loop goes on while the lumen moves: what was recorded after the clock was asked comes on top.
    every = bool((np.abs(steps - 1.0) < 1e-6).all()) and len(run.ticks) + run.lost >= told["ticks"]
    return told | {
        "steps": len(run.ticks),
        "adopted_plans": adopted,
        "beyond_bound_mm": float(beyond[np.isfinite(beyond)].max()),
        "lost_rows": run.lost,
        "replayed": len(beginning.ticks),
        "replayed_the_same": same,
        "correct": every and same and adopted > 0 and told["moved_mm"] > 0.0,
    }


def _drive(process: Process, seconds: float) -> dict[str, Any]:
    begin, held, watched, why = time.monotonic(), 0, 0, ""
    moved, last = 0.0, float("nan")
    while (now := time.monotonic()) < begin + seconds:
        _sign(process, now - begin)
        time.sleep(BEAT_S)
        snapshot = process.snapshot()
        if snapshot is None or not process.alive:
            raise ControlError("the control process ended while it was driven")
        moved += abs(snapshot.progress_mm - last) if np.isfinite(last) else 0.0
        last, watched = snapshot.progress_mm, watched + 1
        held, why = held + snapshot.timing.real_time, snapshot.timing.without_why or why
    process.release()
    return {"real_time_priority": held > 0.9 * watched, "without_priority_because": why, "moved_mm": moved}


def _sign(process: Process, t: float) -> None:
    """What the hand does t s after the beginning."""
    inwards, about, straight, _ = np.cumsum(STRETCH_S)
    phase = t % sum(STRETCH_S)
    if phase < inwards:
        process.axes(0.0, 0.0, 1.0)
    elif phase < about:
        process.axes(float(np.cos(6.0 * phase)), float(np.sin(6.0 * phase)), 0.0)
    elif phase < straight:
        process.axes(0.0, 0.0, 0.0, BUTTON_STRAIGHTEN)
    else:
        process.axes(0.0, 0.0, -1.0)


def record(process: ControlProcess[Any]) -> dict[str, Any]:
    """The clock's own record of every tick."""
    process.ask_record()
    deadline = time.monotonic() + ANSWER_S
    while time.monotonic() < deadline:
        for event in process.events():
            if event.kind == "record":
                found = json.loads(event.text)
                ticks, seconds = found["ticks"], found.pop("seconds")
                return {
                    "rate_hz": (ticks - 1) / max(seconds, 1e-9),
                    "seconds": seconds,
                    **found,
                    "overruns_share": found["overruns"] / max(ticks, 1),
                }
        time.sleep(0.01)
    raise ControlError("the control process did not tell its record")
