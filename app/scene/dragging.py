"""Dragging in the scene: in the plane of the view, with the grabbed point kept under the pointer."""

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
    """A node that reports its drags unless it is locked, which it is initially."""

    def __init__(self, node: Any, item_id: str, position: Position, on_drag: Callable[[DragEvent], object]) -> None:
        """Wrap a node. item_id: for the events. position: of the item, LPS mm; the node is at or near it."""
        self.node, self._id, self._on_drag = node, item_id, on_drag
        self.position = position
        self._offset = np.zeros(3)
        self._locked = True

    def lock(self, locked: bool) -> None:
        """Set whether dragging is disabled."""
        if locked == self._locked:
            return
        self._locked = locked
        if locked:
            self.node.remove_drag_callback("all")
        else:
            self.node.on_drag("left")(self.dragged)

    async def dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        """Report a drag; invalid positions are ignored, but the end of a drag is always reported."""
        end = finite_position(event.end_position)
        if event.phase == "start" and end is not None:
            self._offset = np.array(self.position) - end
        place = None if end is None else finite_position(end + self._offset)
        if place is not None:
            self._on_drag(DragEvent(self._id, event.phase, _position(place)))
        elif event.phase == "end":
            self._on_drag(DragEvent(self._id, event.phase, self.position))


class DragBall:
    """A draggable ball in the accent colour."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        item_id: str,
        radius_mm: float,
        position: Position,
        on_drag: Callable[[DragEvent], object],
    ) -> None:
        """Add the ball. name: of the node. item_id: for the events. position: LPS mm."""
        self._node: Any = scene.add_icosphere(
            name, radius_mm, color=palette.ACCENT, cast_shadow=False, receive_shadow=False
        )
        self._node.position = np.array(position)
        self._drag = Draggable(self._node, item_id, position, on_drag)
        self._selected = False

    def show(self, position: Position, locked: bool, selected: bool = False) -> None:
        """Set its position in LPS mm, whether dragging is disabled, and whether it is highlighted."""
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
