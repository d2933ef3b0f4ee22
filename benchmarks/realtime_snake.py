"""The control process of a snake, driven in a made lumen that breathes: how it keeps its period."""

from __future__ import annotations

import json
import math
import time
from typing import Any

import numpy as np

from vfix_engine.errors import ControlError
from vfix_engine.lumen.anatomy.synthetic import synthetic_colon, synthetic_course
from vfix_engine.lumen.pathway.tissue_motion import breathing
from vfix_engine.lumen.system import LumenSurface, SnakeSnapshot, SnakeSystemSpec
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.process import ControlProcess

LINKS, START_MM = 20, 300.0
BREATH = ((0.0, 0.0, 1.0), 8.0, 4.0, 200.0)  # 8 mm along the body in 4 s, still at the entry
BEAT_S = 0.02  # between two heartbeats of the hand
ANSWER_S, READY_S = 5.0, 600.0
SAME_MM = 1e-9
_LEG_S = 2.0  # in, about, straight, out; so long each


def spec(moving: bool = True) -> SnakeSystemSpec:
    """Twenty links, 300 mm deep in the made colon of seed 0."""
    mesh, marks = synthetic_colon(0), synthetic_course(0).landmarks
    surface = LumenSurface(mesh.vertices, mesh.faces, marks["anus"], marks["caecum"])
    tissue = breathing(*BREATH) if moving else None
    return SnakeSystemSpec(surface, SnakeModel(LINKS), tissue=tissue, tip_s=START_MM).with_contours()


def measure(seconds: float, real_time: bool) -> dict[str, Any]:
    """Every tick of a drive: lateness and step time in µs, and what the robot did meanwhile.

    `correct`: no link that was told was beyond its bound, the tip moved both ways, the camera turned, and every tick
    was one step.
    """
    process: ControlProcess[SnakeSnapshot] = ControlProcess(spec(), real_time)
    try:
        process.start()
        process.wait_ready(READY_S)
        process.run()
        driven = _drive(process, seconds)
        process.release()
        process.pause()
        record = _record(process)
        ticks, span = record["ticks"], record.pop("seconds")
        told = {
            "rate_hz": (ticks - 1) / max(span, 1e-9),
            "seconds": span,
            **record,
            "overruns_share": record["overruns"] / max(ticks, 1),
            **driven,
        }
        moved = driven["moved_mm"] > 1.0 and driven["turned_deg"] > 1.0
        kept = driven["beyond_bound_mm"] <= SAME_MM and abs(_steps(process) - ticks) == 0
        return told | {"correct": bool(moved and kept)}
    finally:
        process.close()


def _axes(since: float) -> tuple[float, float, float, int]:
    """What the hand does so many seconds after it began: camera x, y, insertion, and the straightening button."""
    leg, turn = int(since / _LEG_S) % 4, math.pi * since
    if leg == 1:
        return 0.3 * math.cos(turn), 0.3 * math.sin(turn), 0.0, 0
    return (0.0, 0.0, 0.0, 1) if leg == 2 else (0.0, 0.0, 1.0 if leg == 0 else -1.0, 0)


def _drive(process: ControlProcess[SnakeSnapshot], seconds: float) -> dict[str, Any]:
    began, watched, held, why = time.monotonic(), 0, 0, ""
    beyond, oldest, path, turned = -math.inf, 0.0, 0.0, 0.0
    waits, last = 0, math.nan
    while (since := time.monotonic() - began) < seconds:
        x, y, insert, buttons = _axes(since)
        process.axes(x, y, insert, buttons)
        time.sleep(BEAT_S)
        seen = process.snapshot()
        if seen is None or not process.alive:
            raise ControlError("the control process ended while it was driven")
        inside = np.isfinite(seen.bounds)
        beyond = max(beyond, float((seen.deviations - seen.bounds)[inside].max()))
        oldest = max(oldest, seen.tissue_age_s)
        path += 0.0 if math.isnan(last) else abs(seen.progress_mm - last)
        last = seen.progress_mm
        along = np.diff(seen.capsules[:, :6].reshape(-1, 2, 3), axis=1)[:, 0]
        straight = along[-LINKS // 4] / np.linalg.norm(along[-LINKS // 4])
        turned = max(
            turned, math.degrees(math.acos(min(1.0, float(straight @ seen.camera[:3, 2])))) * (seen.bend > 0.0)
        )
        waits += any(one.kind in ("tissue", "planning") for one in seen.blockers)
        watched, held = watched + 1, held + seen.timing.real_time
        why = seen.timing.without_why or why
    return {
        "real_time_priority": held > 0.9 * watched,
        "without_priority_because": why,
        "beyond_bound_mm": beyond,
        "oldest_tissue_s": oldest,
        "waited_share": waits / max(watched, 1),
        "moved_mm": path,
        "turned_deg": turned,
    }


def _steps(process: ControlProcess[SnakeSnapshot]) -> int:
    """Steps of the system, its clock paused."""
    time.sleep(0.3)
    seen = process.snapshot()
    return -1 if seen is None else seen.steps


def _record(process: ControlProcess[SnakeSnapshot]) -> dict[str, Any]:
    """The clock's own record of every tick, once the robot has come to rest."""
    time.sleep(1.0)
    process.ask_record()
    deadline = time.monotonic() + ANSWER_S
    while time.monotonic() < deadline:
        for event in process.events():
            if event.kind == "record":
                found: dict[str, Any] = json.loads(event.text)
                return found
        time.sleep(0.01)
    raise ControlError("the control process did not tell its record")
