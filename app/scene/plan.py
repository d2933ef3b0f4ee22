"""The plan in the scene: points, targets, ghost, and the spline coloured by the clearance of the whole tool."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import viser

from app.scene import palette, shapes
from app.scene.checks import finite_position

if TYPE_CHECKING:
    from app.scene.view import SceneView

Floats = npt.NDArray[np.float64]

POINT_RADIUS_MM = 1.15
TARGET_RADIUS_MM = 1.6
CURVE_THICKNESS_MM = 0.7


@dataclass(frozen=True)
class PlanItem:
    """A path point or a target as it is drawn."""

    id: str
    kind: str  # 'point' | 'target'
    label: str
    position: tuple[float, float, float]  # LPS [mm]


@dataclass(frozen=True)
class DragEvent:
    """A drag of an item in the plane of the view: phase 'start', 'update' or 'end'; position LPS [mm]."""

    item_id: str
    phase: str
    position: tuple[float, float, float]


class ItemNode:
    """One point or target: a ball or a diamond, with its label, draggable unless locked."""

    def __init__(self, scene: viser.SceneApi, item: PlanItem, on_drag: Callable[[DragEvent], object]) -> None:
        self._item, self._on_drag = item, on_drag
        self._offset = np.zeros(3)
        self._locked = True
        name = f"/plan/{item.kind}_{item.id}"
        if item.kind == "target":
            vertices, faces = shapes.diamond(TARGET_RADIUS_MM)
            self._node: Any = scene.add_mesh_simple(
                name, vertices, faces, color=palette.TARGET, flat_shading=True, cast_shadow=False, receive_shadow=False
            )
        else:
            self._node = scene.add_icosphere(
                name, POINT_RADIUS_MM, color=palette.ACCENT, cast_shadow=False, receive_shadow=False
            )
        self._label = scene.add_label(
            f"{name}_label", item.label, font_screen_scale=0.8, anchor="bottom-left", depth_test=False, visible=False
        )
        self._selected = False
        self.place(np.array(item.position))

    def place(self, position: Floats) -> None:
        self._node.position = position
        self._label.position = position + np.array([0.0, 0.0, 1.6])

    def update(self, item: PlanItem, selected: bool, locked: bool) -> None:
        if item.position != self._item.position:
            self.place(np.array(item.position))
        if item.label != self._item.label:
            self._label.text = item.label
        self._item = item
        if selected != self._selected:
            self._selected = selected
            plain = palette.TARGET if item.kind == "target" else palette.ACCENT
            self._node.color = palette.SELECTED if selected else plain
            self._label.visible = selected
        if locked != self._locked:
            self._locked = locked
            if locked:
                self._node.remove_drag_callback("all")
            else:
                self._node.on_drag("left")(self._dragged)

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        end = finite_position(event.end_position)
        if event.phase == "start" and end is not None:
            self._offset = np.array(self._item.position) - end
        position = None if end is None else finite_position(end + self._offset)
        if position is None:
            if event.phase != "end":
                return
            position = np.array(self._item.position)  # a drag ends wherever it is said to end
        self._on_drag(
            DragEvent(self._item.id, event.phase, (float(position[0]), float(position[1]), float(position[2])))
        )

    def remove(self) -> None:
        self._label.remove()
        self._node.remove()


class ItemNodes:
    """All points and targets."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._items: dict[str, ItemNode] = {}

    def show(self, items: Iterable[PlanItem], selected: str | None, locked: bool) -> None:
        """selected: the id of the item that is marked; locked: none can be dragged."""
        known = {item.id: item for item in items}
        with self._view.atomic():
            for item_id in [drawn for drawn in self._items if drawn not in known]:
                self._items.pop(item_id).remove()
            for item in known.values():
                if item.id not in self._items:
                    self._items[item.id] = ItemNode(self._view.scene, item, self._view.events.item_dragged)
                self._items[item.id].update(item, item.id == selected, locked)

    def remove(self) -> None:
        for item in self._items.values():
            item.remove()


class CurveNodes:
    """The spline of a plan."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._curve: viser.LineSegmentsHandle | None = None

    def show(self, points: Floats | None, clearance_mm: Floats | None) -> None:
        """The spline through (n, 3) places; (n,) clearances colour it, grey while they are not known."""
        if points is None or len(points) < 2:
            if self._curve is not None:
                self._curve.visible = False
            return
        segments = np.stack([points[:-1], points[1:]], axis=1)
        values = np.full(len(points), np.nan) if clearance_mm is None else clearance_mm
        colours = palette.clearance_colours(values)
        pairs = np.stack([colours[:-1], colours[1:]], axis=1)
        if self._curve is None or len(segments) != len(self._curve.points):
            self._curve = self._scene.add_line_segments(
                "/plan/curve", segments, pairs, thickness=CURVE_THICKNESS_MM, thickness_units="world"
            )
            return
        self._curve.points = segments.astype(np.float32)
        self._curve.colors = pairs
        self._curve.visible = True

    def remove(self) -> None:
        if self._curve is not None:
            self._curve.remove()


class GhostNodes:
    """Where a click would add something, and what is said of the place."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._ball: viser.IcosphereHandle | None = None
        self._label: viser.LabelHandle | None = None

    def show(self, position: Floats | None, words: str) -> None:
        if position is None:
            for node in (self._ball, self._label):
                if node is not None:
                    node.visible = False
            return
        if self._ball is None or self._label is None:
            self._ball = self._scene.add_icosphere(
                "/plan/ghost", 1.4, color=palette.GHOST, opacity=0.55, cast_shadow=False, receive_shadow=False
            )
            self._label = self._scene.add_label("/plan/ghost_label", words, font_screen_scale=0.8, anchor="bottom-left")
        self._ball.position = position
        self._label.position = position + np.array([0.0, 0.0, 2.0])
        self._label.text = words
        self._ball.visible = self._label.visible = True

    def remove(self) -> None:
        for node in (self._ball, self._label):
            if node is not None:
                node.remove()
