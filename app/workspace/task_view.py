"""A task of Kwok 2013 at one moment, of a drive or of a run that is replayed: for every client, and in the scene.

Of study I the polyps; of study II the labels, what is left on their arrows, and the way of the tip.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from app.drives.view import place
from app.kit.kept import Same
from app.scene import palette
from app.scene.lumen import MarkNodes, MarkShape
from app.scene.task_labels import LabelNodes, LabelShape
from app.workspace.layers import Layer
from app.workspace.plan_items import position_of
from app.workspace.task_sections import LabelsNowView, PolypSeenView, TaskMomentView, TaskNowView
from vfix_engine.study.diathermy.labels import HALF_MM
from vfix_engine.study.diathermy.live import LabelMoment
from vfix_engine.study.diathermy.task import NEAR_MM
from vfix_engine.study.polyps.aiming import LIMITS
from vfix_engine.study.polyps.live import PolypMoment
from vfix_engine.study.polyps.progress import PolypProgress
from vfix_engine.study.polyps.task import RADIUS_MM

TaskMoment = PolypMoment | LabelMoment

_SHADES = 8  # of a polyp in the scene, where another colour is another node
_SHOWN_MM = 0.2  # between two states of an object that are shown


def moment_key(moment: TaskMoment | None) -> object:
    """Changes with what clients are told of a moment."""
    if not isinstance(moment, LabelMoment):
        return Same(moment)
    state = moment.state
    return state.aimed, state.cutting, state.done, tuple(_end_mm(one.end_mm) for one in state.labels)


def task_moment(moment: TaskMoment | None, words: str = "") -> TaskMomentView:
    """words: why it may differ from the run's score."""
    return {
        "now": _polyps_now(moment, words) if isinstance(moment, PolypMoment) else None,
        "labels": _labels_now(moment, words) if isinstance(moment, LabelMoment) else None,
    }


def task_layers(moment: TaskMoment | None, made_for: object) -> list[Layer[Any]]:
    """The polyps, where the tissue at rest has them; labels, and the tip's way, red where it was cutting.

    made_for: the drive or the run, whose moments have the same polyps or labels.
    """
    if isinstance(moment, LabelMoment):
        return [_label_layer(moment, made_for)]
    return [] if moment is None else [_polyp_layer(moment, made_for)]


def _polyps_now(moment: PolypMoment, words: str) -> TaskNowView:
    task, progress = moment.task, moment.progress
    return {
        "of": len(task.polyps),
        "cleared": progress.cleared,
        "viewed": progress.viewed,
        "seen": _seen(moment),
        "held_s": round(progress.held_s, 2),
        "hold_s": task.hold_s,
        "polyps": [
            {"at": place(at), "colour": round(_colour(progress, index), 3), "cleared": _is_cleared(progress, index)}
            for index, at in enumerate(task.targets(moment.motion, progress.t))
        ],
        "radius_mm": RADIUS_MM,
        "frame_deg": LIMITS.frame_deg,
        "end_mm": round(task.end_mm, 1),
        "end_name": task.end_name or "",
        "viewable_share": task.viewable_share,
        "completed": progress.completed,
        "words": words,
    }


def _seen(moment: PolypMoment) -> PolypSeenView | None:
    aim = moment.seen
    if aim is None:
        return None
    return {"distance_mm": round(aim.distance_mm, 0), "angle_deg": round(aim.angle_deg, 0)}


def _polyp_layer(moment: PolypMoment, made_for: object) -> Layer[Any]:
    progress, rest = moment.progress, moment.task.targets()
    shapes = tuple(
        MarkShape(f"task{index + 1}", _name(progress, index), position_of(at), RADIUS_MM, _shade(progress, index))
        for index, at in enumerate(rest)
    )
    return Layer("drive.polyps", shapes, MarkNodes, lambda nodes: nodes.show(shapes), made_for)


def _is_cleared(progress: PolypProgress, index: int) -> bool:
    return progress.viewings[index].cleared_t is not None


def _name(progress: PolypProgress, index: int) -> str:
    """The number of a polyp along the way, ticked once it is cleared."""
    return f"{index + 1} ✓" if _is_cleared(progress, index) else str(index + 1)


def _colour(progress: PolypProgress, index: int) -> float:
    return progress.marker if index == progress.target else 0.0


def _shade(progress: PolypProgress, index: int) -> tuple[int, int, int]:
    if _is_cleared(progress, index):
        return palette.DONE
    share = 2.0 * round(_colour(progress, index) * _SHADES) / _SHADES
    start, end = palette.SOUGHT[:2] if share < 1.0 else palette.SOUGHT[1:]
    red, green, blue = (round(a + share % 1.0 * (b - a)) for a, b in zip(start, end, strict=True))
    return (red, green, blue) if share < 2.0 else palette.SOUGHT[2]


def _labels_now(moment: LabelMoment, words: str) -> LabelsNowView:
    state = moment.state
    return {
        "labels": [
            {
                "centre": place(label.centre),
                "normal": place(label.normal),
                "along": place(label.along),
                "end_mm": _end_mm(one.end_mm),
            }
            for label, one in zip(moment.labels, state.labels, strict=True)
        ],
        "traced": state.traced,
        "aimed": None if state.aimed is None else state.aimed + 1,
        "cutting": state.cutting,
        "near_mm": NEAR_MM,
        "completed": state.done,
        "words": words,
    }


def _label_layer(moment: LabelMoment, made_for: object) -> Layer[Any]:
    shapes = tuple(
        LabelShape(label.centre, label.normal, label.along, _end_mm(one.end_mm), str(number + 1))
        for number, (label, one) in enumerate(zip(moment.labels, moment.state.labels, strict=True))
    )
    way = moment.way
    key = *(shape.end_mm for shape in shapes), len(way.places)
    return Layer("drive.labels", key, LabelNodes, lambda nodes: nodes.show(shapes, way.places, way.red), made_for)


def _end_mm(end_mm: float) -> float:
    """Rounded, but for the end itself."""
    return HALF_MM if end_mm >= HALF_MM else round(np.floor(end_mm / _SHOWN_MM) * _SHOWN_MM, 1)
