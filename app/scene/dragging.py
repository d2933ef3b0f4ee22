"""What a hand drags in the scene: in the plane of the view, with the place under the pointer kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from app.kit.values import Position
from app.scene import palette
from app.scene.checks import finite_position


@dataclass(frozen=True)
class DragEvent:
    """A drag of an item: phase 'start', 'update' or 'end'; position LPS [mm]."""

    item_id: str
    phase: str
    position: Position


class Draggable:
    """A node that tells of its drags while it is not locked; it is at first."""

    def __init__(self, node: Any, item_id: str, position: Position, on_drag: Callable[[DragEvent], object]) -> None:
        """item_id: of the events. position: of the item, LPS [mm]; the node stands there or beside it."""
        self.node, self._id, self._on_drag = node, item_id, on_drag
        self.position = position
        self._offset = np.zeros(3)
        self._locked = True

    def lock(self, locked: bool) -> None:
        """Whether it cannot be dragged."""
        if locked == self._locked:
            return
        self._locked = locked
        if locked:
            self.node.remove_drag_callback("all")
        else:
            self.node.on_drag("left")(self.dragged)

    async def dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        """Tell of a drag; places that are not finite are left out, but a drag always ends."""
        end = finite_position(event.end_position)
        if event.phase == "start" and end is not None:
            self._offset = np.array(self.position) - end
        place = None if end is None else finite_position(end + self._offset)
        if place is not None:
            self._on_drag(DragEvent(self._id, event.phase, _position(place)))
        elif event.phase == "end":
            self._on_drag(DragEvent(self._id, event.phase, self.position))


class DragBall:
    """A ball in the accent colour that is dragged."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        item_id: str,
        radius_mm: float,
        position: Position,
        on_drag: Callable[[DragEvent], object],
    ) -> None:
        """name: of the node. item_id: of the events. position: LPS mm."""
        self._node: Any = scene.add_icosphere(
            name, radius_mm, color=palette.ACCENT, cast_shadow=False, receive_shadow=False
        )
        self._node.position = np.array(position)
        self._drag = Draggable(self._node, item_id, position, on_drag)
        self._selected = False

    def show(self, position: Position, locked: bool, selected: bool = False) -> None:
        """Where it is, whether it can be dragged, and whether it is marked."""
        self._node.position = np.array(position)
        self._drag.position = position
        if selected != self._selected:
            self._selected = selected
            self._node.color = palette.SELECTED if selected else palette.ACCENT
        self._drag.lock(locked)

    def remove(self) -> None:
        self._node.remove()


def _position(place: npt.NDArray[np.float64]) -> Position:
    x, y, z = place.tolist()
    return (x, y, z)
