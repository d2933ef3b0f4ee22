"""Labels of a task on the wall of a cavity, what is left on their arrows, and the way of the tool's tip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.scene import palette
from app.scene.lines import GrowingLines, Lines, circle, joined
from vfix_engine.arrays import Array, BoolArray

if TYPE_CHECKING:
    from app.scene.labels import SceneLabel
    from app.scene.view import SceneView

RADIUS_MM, HALF_MM = 16.5, 10.0  # of a label, and of its arrow
_HEAD_MM = 3.0
_RIM_MM, _ARROW_MM, _OBJECT_MM, _WAY_MM = 0.6, 0.8, 2.0, 0.6


@dataclass(frozen=True, eq=False)
class LabelShape:
    """A label: its middle (3,) LPS mm, its face and arrow (3,) unit. end_mm: where what is left on it begins."""

    centre: Array
    normal: Array
    along: Array
    end_mm: float
    name: str

    @property
    def done(self) -> bool:
        """Nothing is left on it."""
        return self.end_mm >= HALF_MM


class LabelNodes:
    """All labels of a task."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._rims = Lines(view, "/drive/labels/rims", palette.TASK_LABEL, _RIM_MM)
        self._arrows = Lines(view, "/drive/labels/arrows", palette.TASK_LABEL, _ARROW_MM)
        self._done = Lines(view, "/drive/labels/done", palette.DONE, _RIM_MM)
        self._objects = Lines(view, "/drive/labels/objects", palette.SOUGHT[2], _OBJECT_MM)
        self._way = GrowingLines(view, "/drive/labels/way", palette.TIP_WAY, _WAY_MM)
        self._cut = GrowingLines(view, "/drive/labels/cut", palette.TIP_CUT, _WAY_MM)
        self._names: list[SceneLabel] = []
        self._shown: tuple[bool, ...] | None = None  # which labels are drawn as done

    def show(self, labels: tuple[LabelShape, ...], way: Array, red: BoolArray) -> None:
        """labels: the same each time, but for what is left on them.

        way: (n, 3) LPS mm of the tip so far, which only grows; red: (n,) where it was cutting.
        """
        done = tuple(one.done for one in labels)
        if done != self._shown:
            self._shown = done
            self._outline(labels)
        left = [_line(one, one.end_mm, HALF_MM) for one in labels if not one.done]
        self._objects.show(np.array(left) if left else np.zeros((0, 2, 3)))
        pieces = np.stack([way[:-1], way[1:]], axis=1) if len(way) > 1 else np.zeros((0, 2, 3))
        self._way.show(pieces[~red[1:]])
        self._cut.show(pieces[red[1:]])

    def _outline(self, labels: tuple[LabelShape, ...]) -> None:
        """Rims, arrows and numbers: in another colour and ticked where a label is done."""
        left, done = [one for one in labels if not one.done], [one for one in labels if one.done]
        none = [np.zeros((0, 2, 3))]
        self._rims.show(np.concatenate(none + [_rim(one) for one in left]))
        self._arrows.show(np.concatenate(none + [_arrow(one) for one in left]))
        self._done.show(np.concatenate(none + [part(one) for one in done for part in (_rim, _arrow)]))
        for one in labels[len(self._names) :]:
            name, at = f"/drive/labels/{one.name}_label", one.centre + (RADIUS_MM + 2.0) * one.along
            add, kind = self._view.labels.add, "bead inside"
            self._names.append(add(name, "", kind, at, font_screen_scale=0.8, anchor="center-center", depth_test=False))
        for label, one in zip(self._names, labels, strict=True):
            label.text = f"{one.name} ✓" if one.done else one.name

    def remove(self) -> None:
        for lines in (self._rims, self._arrows, self._done, self._objects, self._way, self._cut):
            lines.remove()
        for name in self._names:
            name.remove()


def _rim(one: LabelShape) -> Array:
    """(n, 2, 3)"""
    return joined(circle(one.centre, one.normal, RADIUS_MM))


def _line(one: LabelShape, start_mm: float, end_mm: float) -> Array:
    return np.array([one.centre + start_mm * one.along, one.centre + end_mm * one.along])


def _arrow(one: LabelShape) -> Array:
    """(3, 2, 3) its shaft and its head."""
    across = np.cross(one.normal, one.along)
    tip = one.centre + HALF_MM * one.along
    heads = [np.array([tip, tip - _HEAD_MM * (one.along + side * 0.6 * across)]) for side in (-1.0, 1.0)]
    return np.array([_line(one, -HALF_MM, HALF_MM), *heads])
