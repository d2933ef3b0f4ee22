"""The control process of a world, driven back and forth: how it keeps its rate of 1 kHz (HAZ-10)."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from benchmarks import cases, realtime_snake, report
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError
from vfix_engine.worlds.rigid.realtime import RehearsalProcess, SceneSpec

SUMMARY = "the rate and lateness of a driven control process"
BEAT_S = 0.02  # between two heartbeats of the hand
ANSWER_S = 5.0
REST_S = 0.3
SAME_MM = 1e-9
MOST_OVERRUNS = 0.01  # fraction of all ticks on a quiet machine


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: which head, how long, and whether to request a real-time priority."""
    cases.add_arguments(parser)
    parser.set_defaults(case="phantom")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long the tool is driven (default 60)")
    parser.add_argument("--world", choices=tuple(WORLDS), default="rigid", help="what is driven (default rigid)")
    parser.add_argument("--no-priority", action="store_true", help="ask for no real-time priority, to compare")


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Measure rate, lateness and step time of every tick.

    `overruns_share`: fraction of the ticks that began at least a period late. `correct`: every tick was one step of the
    rehearsal, the tool moved, and no reported pose violated the margin.
    """
    if not 0.5 <= args.seconds <= 86_400:
        raise report.BenchmarkRefused(f"--seconds {args.seconds:g} is not between 0.5 and 86400")
    machine = report.machine().to_dict()
    measured = WORLDS[args.world](args)
    shares = [one["overruns_share"] for one in measured["cases"].values() if one is not None]
    return {
        "machine": machine,
        "world": args.world,
        **measured,
        "overruns_share": max(shares),
        "correct": all(one["correct"] for one in measured["cases"].values() if one is not None),
        "overruns_within_1_percent": max(shares) <= MOST_OVERRUNS,
    }


def _rigid(args: argparse.Namespace) -> dict[str, Any]:
    return cases.find_cases(args).measure(lambda case: _measure(case, args.seconds, not args.no_priority))


def _snake(args: argparse.Namespace) -> dict[str, Any]:
    return {"cases": {"breathing bend": realtime_snake.measure(args.seconds, not args.no_priority)}}


WORLDS: dict[str, Callable[[argparse.Namespace], dict[str, Any]]] = {"rigid": _rigid, "snake": _snake}


def _measure(case: cases.BenchCase, seconds: float, real_time: bool) -> dict[str, Any]:
    settings = ControlSettings()
    with driven_process(case, settings, real_time) as process:
        process.run()
        driven_so = _drive(process, seconds)
        told = {"period_us": 1e6 * settings.dt_s} | realtime_snake.record(process) | driven_so
        kept = told["steps"] == told["ticks"] and told["min_clearance_mm"] >= settings.margin_mm - SAME_MM
        return told | {"correct": kept and told["moved_mm"] > 0.0}


@contextmanager
def driven_process(
    case: cases.BenchCase, settings: ControlSettings, real_time: bool = True
) -> Iterator[RehearsalProcess]:
    """Yield the control process of a case, ready and paused with the robot at the entry."""
    scene = cases.drive(case).scene
    spec = SceneSpec(
        vertices=case.mesh.vertices,
        faces=case.mesh.faces,
        robot=cases.ROBOT,
        tool=cases.TOOL,
        base=scene.base,
        q_start=scene.q_start,
        path_points=case.path.points,
        targets=scene.targets,
        target_names=scene.target_names,
    )
    process = RehearsalProcess(spec, settings, real_time)
    try:
        process.start()
        process.wait_ready()
        yield process
    finally:
        process.close()


def _drive(process: RehearsalProcess, seconds: float) -> dict[str, Any]:
    """Drive forwards to the end of the path and back to its entry repeatedly; return whether the priority was kept."""
    direction, held, watched, why = 1, 0, 0, ""
    least, way, last = float("inf"), 0.0, 0.0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        process.drive(direction)
        time.sleep(BEAT_S)
        snapshot = process.snapshot()
        if snapshot is None or not process.alive:
            raise ControlError("the control process ended while it was driven")
        if snapshot.progress_mm > snapshot.length_mm - 1:
            direction = -1
        elif snapshot.progress_mm < 1:
            direction = 1
        least, way, last = (
            min(least, snapshot.clearance_mm),
            way + abs(snapshot.progress_mm - last),
            snapshot.progress_mm,
        )
        watched, held, why = watched + 1, held + snapshot.timing.real_time, snapshot.timing.without_why or why
    process.release()
    return {
        "real_time_priority": held > 0.9 * watched,
        "without_priority_because": why,
        "min_clearance_mm": least,
        "moved_mm": way,
        "steps": _steps_at_rest(process),
    }


def _steps_at_rest(process: RehearsalProcess) -> int:
    """Return the steps of the rehearsal after the tool has come to rest."""
    steps, deadline = -1, time.monotonic() + ANSWER_S
    while time.monotonic() < deadline:
        time.sleep(REST_S)
        snapshot = process.snapshot()
        if snapshot is not None and snapshot.steps == steps:
            return steps
        steps = -1 if snapshot is None else snapshot.steps
    raise ControlError("the tool did not come to rest")
