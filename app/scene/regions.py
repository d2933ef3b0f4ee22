"""Structures to spare and bone to be removed in the scene: translucent in their colour, and as a net."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import viser

from app.kit.values import Position
from app.scene import palette
from app.scene.dragging import DragBall, DragEvent
from app.scene.lines import Lines, joined, ring

if TYPE_CHECKING:
    from app.scene.view import SceneView

OPACITY = 0.35
HANDLE_RADIUS_MM = 0.9
PLACE_RADIUS_MM = 1.5
PLACE_THICKNESS_MM = 0.4


@dataclass(frozen=True)
class DrawnRegion:
    """A region as it is drawn.

    removed: bone that is to be removed, which is a net. handle: the place of the ball that it is dragged by, LPS mm,
    None where it has none. key: of its mesh; mesh: makes vertices and faces, LPS mm.
    """

    id: str
    colour: str
    removed: bool
    handle: Position | None
    selected: bool
    key: str
    mesh: Callable[[], tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]] = field(compare=False)


class RegionNode:
    """One region: its surface, and its ball."""

    def __init__(self, scene: viser.SceneApi, region: DrawnRegion, on_drag: Callable[[DragEvent], object]) -> None:
        self._scene, self._on_drag = scene, on_drag
        self._region: DrawnRegion | None = None
        self._surface: Any = None
        self._ball: DragBall | None = None
        self._name = f"/plan/region_{region.id}"

    def update(self, region: DrawnRegion, locked: bool) -> None:
        before, self._region = self._region, region
        style = None if before is None else (before.key, before.colour, before.removed)
        if style != (region.key, region.colour, region.removed):
            self._show_surface(region)
        self._show_ball(region, locked)

    def _show_surface(self, region: DrawnRegion) -> None:
        vertices, faces = region.mesh()
        colour = np.array([int(region.colour[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.uint8)
        self._surface = self._scene.add_mesh_simple(
            self._name,
            vertices,
            faces,
            color=colour,
            opacity=0.8 if region.removed else OPACITY,
            wireframe=region.removed,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _show_ball(self, region: DrawnRegion, locked: bool) -> None:
        if region.handle is None:
            return
        if self._ball is None:
            name, item = f"{self._name}_handle", f"region:{region.id}"
            self._ball = DragBall(self._scene, name, item, HANDLE_RADIUS_MM, region.handle, self._on_drag)
        self._ball.show(region.handle, locked, region.selected)

    def remove(self) -> None:
        for node in (self._surface, self._ball):
            if node is not None:
                node.remove()


class RegionNodes:
    """All regions of a plan."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._nodes: dict[str, RegionNode] = {}

    def show(self, regions: Iterable[DrawnRegion], locked: bool) -> None:
        """locked: none can be dragged."""
        known = {region.id: region for region in regions}
        with self._view.atomic():
            for region_id in [drawn for drawn in self._nodes if drawn not in known]:
                self._nodes.pop(region_id).remove()
            for region in known.values():
                if region.id not in self._nodes:
                    self._nodes[region.id] = RegionNode(self._view.scene, region, self._view.events.item_dragged)
                self._nodes[region.id].update(region, locked)

    def remove(self) -> None:
        for node in self._nodes.values():
            node.remove()


class DrawingNodes:
    """The places that were clicked of what is being drawn: rings, joined in order, which are seen through bone."""

    def __init__(self, view: SceneView) -> None:
        self._lines = Lines(view, "/plan/drawing", palette.SELECTED, PLACE_THICKNESS_MM)

    def show(self, places: Sequence[Position]) -> None:
        """places: LPS mm, in the order of the clicks."""
        chain = joined(np.array(places, dtype=np.float64).reshape(-1, 3))
        rings = [joined(ring(np.array(place), PLACE_RADIUS_MM)) for place in places]
        self._lines.show(np.concatenate([chain, *rings]))

    def remove(self) -> None:
        self._lines.remove()
