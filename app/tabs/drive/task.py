"""The task of a drive on the page: what is chosen, its progress for every client, and its polyps in the scene."""

from __future__ import annotations

from typing import Any

from app.drives.view import place
from app.kit.kept import Same
from app.lumen.document import StoredRoute
from app.lumen.drive_options import LumenDriveOptions
from app.lumen.task_watch import LabelWatch, PolypWatch, TaskWatch
from app.lumen.tasks import TaskChoice, TaskName
from app.messages.sections import Section
from app.scene import palette
from app.scene.lumen import MarkNodes, MarkShape
from app.tabs.drive import commands as c
from app.tabs.drive.labels import label_layers, labels_key, labels_now
from app.tabs.drive.sections import DriveTaskView, PolypSeenView, TaskNowView
from app.tabs.drive.view import SnakeRecord
from app.workspace.layers import Layer
from vfix_engine.study.polyps.aiming import LIMITS
from vfix_engine.study.polyps.progress import PolypProgress
from vfix_engine.study.polyps.task import RADIUS_MM

_SHADES = 8  # of a polyp in the scene, where another colour is another node


def chosen_task(command: c.ChooseTask) -> TaskChoice | None:
    """What a client chooses."""
    if command.task is None:
        return None
    return TaskChoice(command.task, command.places, command.seed, command.count, command.hold_s)


def task_section(
    now: SnakeRecord, options: LumenDriveOptions, open_: bool, route: StoredRoute | None, offered: tuple[TaskName, ...]
) -> Section[object]:
    """The :class:`DriveTaskView`. open_: this client may choose; offered: in the open case."""
    chosen = options.task
    watch = None if now.prepared is None else now.prepared.task
    polyps = watch if isinstance(watch, PolypWatch) else None
    labels = watch if isinstance(watch, LabelWatch) else None
    progress, state = None if polyps is None else polyps.progress, None if labels is None else labels.state
    marks = 0 if route is None else sum(mark.kind == "polyp" for mark in route.content.marks)
    told = offered, chosen, marks, open_, None if watch is None else watch.trouble

    def build() -> DriveTaskView:
        choice = chosen or TaskChoice()
        return {
            "offered": list(offered),
            "task": None if chosen is None else chosen.task,
            "places": choice.places,
            "seed": choice.seed,
            "marks": marks,
            "open": open_,
            "now": None if polyps is None or progress is None else _task_now(polyps, progress),
            "labels": None if labels is None or state is None else labels_now(labels, state),
        }

    return Section((*told, Same(progress), None if state is None else labels_key(state)), build)


def _task_now(watch: PolypWatch, progress: PolypProgress) -> TaskNowView:
    task = watch.task
    targets = task.targets(watch.motion, progress.t)
    return {
        "of": len(task.polyps),
        "cleared": progress.cleared,
        "viewed": progress.viewed,
        "seen": _seen(watch, progress),
        "held_s": round(progress.held_s, 2),
        "hold_s": task.hold_s,
        "polyps": [
            {"at": place(at), "colour": round(_colour(progress, index), 3), "cleared": _is_cleared(progress, index)}
            for index, at in enumerate(targets)
        ],
        "radius_mm": RADIUS_MM,
        "frame_deg": LIMITS.frame_deg,
        "end_mm": round(task.end_mm, 1),
        "end_name": task.end_name or "",
        "viewable_share": task.viewable_share,
        "completed": progress.completed,
        "words": watch.trouble,
    }


def _seen(watch: PolypWatch, progress: PolypProgress) -> PolypSeenView | None:
    if watch.live is None or not watch.live.in_picture or progress.aim is None:
        return None
    return {"distance_mm": round(progress.aim.distance_mm, 0), "angle_deg": round(progress.aim.angle_deg, 0)}


def task_layers(watch: TaskWatch[Any] | None) -> list[Layer[Any]]:
    """The polyps where the tissue at rest has them; labels, and the tip's way."""
    if isinstance(watch, LabelWatch):
        return label_layers(watch)
    return polyp_layers(watch) if isinstance(watch, PolypWatch) else []


def polyp_layers(watch: PolypWatch) -> list[Layer[Any]]:
    progress = watch.progress
    if progress is None:
        return []
    rest = watch.task.targets()
    shapes = tuple(
        MarkShape(f"task{index + 1}", _name(progress, index), _triple(at), RADIUS_MM, _shown_colour(progress, index))
        for index, at in enumerate(rest)
    )
    return [Layer("drive.polyps", shapes, MarkNodes, lambda nodes: nodes.show(shapes), Same(watch))]


def _is_cleared(progress: PolypProgress, index: int) -> bool:
    return progress.viewings[index].cleared_t is not None


def _name(progress: PolypProgress, index: int) -> str:
    """The number of a polyp along the way, ticked once it is cleared."""
    return f"{index + 1} ✓" if _is_cleared(progress, index) else str(index + 1)


def _shown_colour(progress: PolypProgress, index: int) -> tuple[int, int, int]:
    return palette.DONE if _is_cleared(progress, index) else _shade(_colour(progress, index))


def _colour(progress: PolypProgress, index: int) -> float:
    return progress.marker if index == progress.target else 0.0


def _shade(colour: float) -> tuple[int, int, int]:
    share = 2.0 * round(colour * _SHADES) / _SHADES
    start, end = palette.SOUGHT[:2] if share < 1.0 else palette.SOUGHT[1:]
    red, green, blue = (round(a + share % 1.0 * (b - a)) for a, b in zip(start, end, strict=True))
    return (red, green, blue) if share < 2.0 else palette.SOUGHT[2]


def _triple(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
