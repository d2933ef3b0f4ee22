"""The labels of study II on the page: their state for every client, and their arrows and the tip's way in the scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.drives.view import place
from app.kit.kept import Same
from app.lumen.task_watch import LabelWatch
from app.scene.task_labels import LabelNodes, LabelShape
from app.tabs.drive.sections import LabelsNowView
from app.workspace.layers import Layer
from vfix_engine.study.diathermy.labels import HALF_MM
from vfix_engine.study.diathermy.task import NEAR_MM, DiathermyState

_SHOWN_MM = 0.2  # between two states of an object that are shown


def labels_key(state: DiathermyState) -> tuple[object, ...]:
    """Changes with what is shown of a state."""
    return state.aimed, state.cutting, state.done, tuple(_end_mm(one.end_mm) for one in state.labels)


def labels_now(watch: LabelWatch, state: DiathermyState) -> LabelsNowView:
    """How far the labels are."""
    return {
        "labels": [
            {
                "centre": place(label.centre),
                "normal": place(label.normal),
                "along": place(label.along),
                "end_mm": _end_mm(one.end_mm),
            }
            for label, one in zip(watch.labels, state.labels, strict=True)
        ],
        "traced": state.traced,
        "aimed": None if state.aimed is None else state.aimed + 1,
        "cutting": state.cutting,
        "near_mm": NEAR_MM,
        "completed": state.done,
        "words": watch.trouble,
    }


def label_layers(watch: LabelWatch) -> list[Layer[Any]]:
    """The labels with what is left on them, and the way of the tip, red where it was cutting."""
    live, state = watch.live, watch.state
    if live is None or state is None:
        return []
    shapes = tuple(
        LabelShape(label.centre, label.normal, label.along, _end_mm(one.end_mm), str(number + 1))
        for number, (label, one) in enumerate(zip(watch.labels, state.labels, strict=True))
    )
    way = live.way
    key = *(shape.end_mm for shape in shapes), len(way.places)
    return [Layer("drive.labels", key, LabelNodes, lambda nodes: nodes.show(shapes, way.places, way.red), Same(watch))]


def _end_mm(end_mm: float) -> float:
    """Rounded, but for the end itself."""
    return HALF_MM if end_mm >= HALF_MM else round(np.floor(end_mm / _SHOWN_MM) * _SHOWN_MM, 1)
