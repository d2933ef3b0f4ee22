"""A score in words, units and digits, as the card at the end of a drive has it (lumen-score.js, run-score.js)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Fact = tuple[str, str]  # its name, and its value with the unit

_END_MM = 2.0  # a robot that comes so near to the end of its way comes to it


def facts_of(score: dict[str, Any]) -> list[Fact]:
    """What is worth saying of a run, in the order in which it is read."""
    return list(_lumen_facts(score) if "arm" in score else _tool_facts(score))


def _lumen_facts(score: dict[str, Any]) -> Iterator[Fact]:
    off, nearest, beyond, task = (score[name] for name in ("deviation", "nearest_mm", "beyond_bound_mm", "task"))
    yield "Time driven", _duration(score["time_s"])
    if score["depth_mm"] is not None:  # from a fixed base nothing is inserted
        back = score["withdrawal_s"]
        yield "Depth", f"{_fixed(score['depth_mm'], 0)} mm"
        yield "Share of the route", f"{_fixed(100.0 * score['share'], 0)} %"
        yield "Time in", _duration(score["insertion_s"])
        yield "Withdrawal", "not drawn out" if back is None else _duration(back)
    if off is not None:
        yield "Deviations", f"{off['episodes']}, {_duration(off['time_s'])}"
        yield "Deviation, largest", f"{_fixed((off['depth_mm'] or {'max': 0.0})['max'], 1)} mm"
    if nearest is not None:
        yield "Nearest to a bound", f"{_fixed(nearest['max'], 1)} mm"
    yield "Bound, largest", f"{_fixed(score['bound_mm'], 1)} mm"
    yield "Beyond bound", f"{_fixed(beyond, 1 if beyond > 0.0 else 0)} mm"
    if (behind := score["behind_wall"]) is not None:
        links = behind["links_mm"]
        yield "Behind wall, links", "not measured" if links is None else f"{_fixed(links, 1)} mm"
        yield "Behind wall, pathway", f"{_fixed(100.0 * behind['share'], 0)} %, {_fixed(behind['depth_mm'], 1)} mm"
    yield "Path of the tip", f"{_fixed(score['path_length_mm'], 0)} mm"
    yield "Hand force, mean", f"{_fixed(score['force_n']['mean'], 2)} N"
    yield "Hand force, largest", f"{_fixed(score['force_n']['max'], 1)} N"
    yield "Held", _duration(score["held_s"])
    if task is None:
        reach, length = score["reach_mm"], score["length_mm"]
        short = reach is not None and reach < length - _END_MM
        came = "as deep as this robot comes" if short else "yes"
        yield "End reached", came if score["completed"] else "no"
        return
    yield "Task completed", "yes" if task["completed"] else "no"
    for row in task["rows"]:
        unit = f" {row['unit']}" if row["unit"] and row["value"] is not None else ""
        yield row["name"], f"{_fixed(row['value'], row['digits'])}{unit}"
    if task["lacking"]:
        yield task["title"], task["lacking"]


def _tool_facts(score: dict[str, Any]) -> Iterator[Fact]:
    path, target, true = (score[name] for name in ("path_error_mm", "target_error_mm", "true_error_mm"))
    yield "Time", _duration(score["time_s"])
    if path is not None:
        yield "Tip error, mean", _length(path["robot_frame"]["mean"])
        yield "Tip error, largest", _length(path["robot_frame"]["max"])
    if true is not None and not _is_exact(score):
        yield "True tip error, mean", _length(true["mean"])
        yield "True tip error, largest", _length(true["max"])
    if target is not None:
        yield "Target error, mean", _length(target["robot_frame"]["mean"])
    if score["angle_deg"] is not None:
        yield "Angle covered", f"{_fixed(score['angle_deg'], 0)}°"
    for name, least in score["least_clearance_mm"].items():
        yield f"Nearest to {name}", _length(least)
    if score["contacts"]:
        yield "Contacts", f"{score['contacts']}, {_fixed(score['max_depth_mm'], 1)} mm deep"
    elif not score["certified"]:
        yield "Contacts", "none"
    if score["mode"] != "freehand":  # nothing holds a free hand
        yield "Held", _duration(score["held_s"])
    if score["spectral_arc_length"] is not None:
        yield "Smoothness", _fixed(score["spectral_arc_length"], 2)


def _is_exact(score: dict[str, Any]) -> bool:
    """Whether the true tool is where the robot has it."""
    path = score["path_error_mm"]
    return path is None or path["true_frame"] == path["robot_frame"]


def _duration(seconds: float) -> str:
    if seconds < 60.0:
        return f"{_fixed(seconds, 1)} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d} min"


def _length(value: float) -> str:
    """With as many digits as it deserves: errors of a robot are hundredths."""
    if 0.0 < value < 0.0005:
        return "< 0.001 mm"
    return f"{_fixed(value, 3 if abs(value) < 0.1 else 2)} mm"


def _fixed(value: float | None, digits: int) -> str:
    if value is None:
        return "–"
    text = f"{value:.{digits}f}"
    return text.replace("-", "−" if float(text) else "")
