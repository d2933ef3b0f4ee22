"""The plan in the scene: points, targets, ghost, and the spline coloured by the clearance of the whole tool."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from app.scene import palette, shapes
from app.scene.dragging import DragEvent, Draggable
from app.scene.labels import SceneLabels
from app.scene.lines import ring
from vfix_engine.arrays import Array

if TYPE_CHECKING:
    from app.scene.view import SceneView


POINT_RADIUS_MM = 1.15
TARGET_RADIUS_MM = 1.6
CURVE_THICKNESS_MM = 0.7
GHOST_RADIUS_MM = 2.2
GHOST_THICKNESS_MM = 0.45
PREVIEW_THICKNESS_MM = 0.35


@dataclass(frozen=True)
class PlanItem:
    """A path point or a target as it is drawn."""

    id: str
    kind: str  # 'point' | 'target'
    label: str
    position: tuple[float, float, float]  # LPS [mm]


class ItemNode:
    """One point or target: a ball or a diamond, with its label, draggable unless locked."""

    def __init__(
        self, scene: viser.SceneApi, labels: SceneLabels, item: PlanItem, on_drag: Callable[[DragEvent], object]
    ) -> None:
        self._item = item
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
        self._label = labels.add(
            f"{name}_label",
            item.label,
            "item",
            visible=False,
            font_screen_scale=0.8,
            anchor="bottom-left",
            depth_test=False,
        )
        self._selected = False
        self.drag = Draggable(self._node, item.id, item.position, on_drag)
        self._place(item)

    def _place(self, item: PlanItem) -> None:
        self.drag.position, position = item.position, np.array(item.position)
        self._node.position = position
        self._label.position = position + np.array([0.0, 0.0, 1.6])

    def update(self, item: PlanItem, selected: bool, locked: bool) -> None:
        if item.position != self._item.position:
            self._place(item)
        if item.label != self._item.label:
            self._label.text = item.label
        self._item = item
        if selected != self._selected:
            self._selected = selected
            plain = palette.TARGET if item.kind == "target" else palette.ACCENT
            self._node.color = palette.SELECTED if selected else plain
            self._label.visible = selected
        self.drag.lock(locked)

    def remove(self) -> None:
        self._label.remove()
        self._node.remove()


class ItemNodes:
    """All points and targets."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._items: dict[str, ItemNode] = {}

    def show(self, items: Iterable[PlanItem], selected: str | None, locked: bool) -> None:
        """Draw these items and no others. selected: id of the highlighted item. locked: dragging is disabled."""
        known = {item.id: item for item in items}
        with self._view.atomic():
            for item_id in [drawn for drawn in self._items if drawn not in known]:
                self._items.pop(item_id).remove()
            for item in known.values():
                if item.id not in self._items:
                    self._items[item.id] = ItemNode(
                        self._view.scene, self._view.labels, item, self._view.events.item_dragged
                    )
                self._items[item.id].update(item, item.id == selected, locked)

    def remove(self) -> None:
        for item in self._items.values():
            item.remove()


class CurveNodes:
    """The spline of a plan."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._curve: viser.LineSegmentsHandle | None = None

    def show(self, points: Array | None, clearance_mm: Array | None) -> None:
        """Draw the spline through points (n, 3), LPS mm, coloured by clearances (n,) in mm; grey without them."""
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
    """Preview of a click: a ring in the accent colour where it would add a point, and the resulting path."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._lines: dict[str, viser.LineSegmentsHandle] = {}

    def show(self, position: Array | None, path: Array | None = None) -> None:
        """Draw the preview. position (3,): LPS mm. path (n, 3): spline with the new point, None for no path point."""
        self._line("ring", None if position is None else ring(position, GHOST_RADIUS_MM), GHOST_THICKNESS_MM)
        self._line("path", None if position is None else path, PREVIEW_THICKNESS_MM)

    def _line(self, name: str, places: Array | None, thickness: float) -> None:
        line = self._lines.get(name)
        if places is None or len(places) < 2:
            if line is not None:
                line.visible = False
            return
        segments = np.stack([places[:-1], places[1:]], axis=1).astype(np.float32)
        if line is None or len(segments) != len(line.points):
            self._lines[name] = self._view.scene.add_line_segments(
                f"/plan/ghost_{name}", segments, palette.ACCENT, thickness=thickness, thickness_units="world"
            )
            return
        line.points = segments
        line.visible = True

    def remove(self) -> None:
        for line in self._lines.values():
            line.remove()
