"""The sections of a drive that are common to all worlds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from app.drives.drive_record import DriveRecord
from app.drives.sections import DetailsSection, DriveMotion, DriveSection
from vfix_engine.runtime.snapshot import Snapshot, Timing

HAND_LOST = "Connection too slow: drive stopped. Press again."
SHOWN_COMMENTS = 20
FREE = "Nothing, the robot is free to move"


def drive_section(now: DriveRecord[Any, Any]) -> DriveSection:
    """The holder of the handle, and the state of the process."""
    return {
        "state": now.shown_state,
        "words": now.words,
        "fraction": None if now.fraction is None else number(now.fraction, 3),
        "mine": now.mine,
        "holder": "Another window" if now.holder is not None and not now.mine else None,
        "can_take": now.holder is None,
        "unrecorded": now.unrecorded or None,
        "comments": [{"id": one.id, "t_s": one.t_s, "text": one.text} for one in now.comments[::-1][:SHOWN_COMMENTS]],
    }


def motion(snapshot: Snapshot) -> DriveMotion:
    """The figures of any world: lengths in mm, force in N."""
    return {
        "holding": snapshot.blockers[0].words if snapshot.blockers else FREE,
        "force_n": number(np.linalg.norm(snapshot.forces), 3),
        "progress_mm": number(snapshot.progress_mm, 2),
        "length_mm": number(snapshot.length_mm, 2),
        "tip": place(snapshot.tip),
    }


def details_section(snapshot: Snapshot | None) -> DetailsSection:
    """Timing of the control loop."""
    if snapshot is None:
        return {}
    timing = snapshot.timing
    return {
        "loop_hz": number(timing.loop_hz, 0),
        "step_us": number(timing.step_us, 0),
        "step_us_p99": number(timing.step_us_p99, 0),
        "lateness_us_p50": number(timing.lateness_us_p50, 1),
        "lateness_us_p99": number(timing.lateness_us_p99, 1),
        "overruns": timing.overruns,
        "steps": snapshot.steps,
        "priority": _priority(timing),
    }


def _priority(timing: Timing) -> str:
    """Whether the loop has its real-time priority, and why not."""
    if timing.real_time:
        return "Held"
    return f"None: {timing.without_why}" if timing.without_why else "Taken while somebody drives"


def number(value: Any, digits: int) -> float | None:
    """Rounded; None for what is not finite, which JSON does not have."""
    found = float(value)
    return round(found, digits) if math.isfinite(found) else None


def place(values: Any) -> list[float]:
    """A place in mm, rounded."""
    return [round(float(value), 4) for value in values]
