"""The planned direction of the shaft at the selected path point in the scene, and the preview of a suggested path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.scene import palette
from app.scene.dragging import DragBall
from app.scene.lines import Lines, joined, ring
from vfix_engine.arrays import Array

if TYPE_CHECKING:
    from app.scene.view import SceneView


HANDLE = "shaft:"  # prefix of the item id of the ball that turns the shaft of a path point
LINE_MM = 30.0  # of a direction, from the point towards the tail
BALL_MM = 0.9
RING_MM = 1.8  # radius of the ring around that ball, which bone may hide
THICKNESS_MM = 0.35
SUGGESTED_THICKNESS_MM = 1.0
_NOTHING = np.zeros((0, 2, 3))


@dataclass(frozen=True)
class ShaftHandle:
    """A planned direction as it is drawn, from a path point in LPS mm towards the tail; direction is a unit vector."""

    point_id: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]

    @property
    def end(self) -> tuple[float, float, float]:
        """Position of the ball that it is dragged by, LPS mm."""
        x, y, z = (p + LINE_MM * d for p, d in zip(self.position, self.direction, strict=True))
        return (x, y, z)


class ShaftNodes:
    """A line from the selected point towards the tail, which a ball at its end turns.

    The ball has a ring, since lines show through bone and balls do not.
    """

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._line = Lines(view, "/plan/shaft", palette.UNKNOWN, THICKNESS_MM)
        self._ring = Lines(view, "/plan/shaft_ring", palette.ACCENT, THICKNESS_MM)
        self._ball: tuple[str, DragBall] | None = None  # of the point with that id

    def show(self, handle: ShaftHandle | None, locked: bool) -> None:
        """Draw this direction, or none. locked: dragging is disabled."""
        self._line.show(_NOTHING if handle is None else np.array([(handle.position, handle.end)]))
        with self._view.atomic():
            self._ring.show(_NOTHING if handle is None else joined(ring(np.array(handle.end), RING_MM)))
            if self._ball is not None and (handle is None or handle.point_id != self._ball[0]):
                self._ball[1].remove()
                self._ball = None
            if handle is None:
                return
            if self._ball is None:
                name, item = f"/plan/shaft_{handle.point_id}", HANDLE + handle.point_id
                dragged = self._view.events.item_dragged
                self._ball = (handle.point_id, DragBall(self._view.scene, name, item, BALL_MM, handle.end, dragged))
            self._ball[1].show(handle.end, locked)

    def remove(self) -> None:
        self._line.remove()
        self._ring.remove()
        if self._ball is not None:
            self._ball[1].remove()


class SuggestedNodes:
    """The preview of a suggested path and its directions."""

    def __init__(self, view: SceneView) -> None:
        self._curve = Lines(view, "/plan/suggested", palette.ACCENT, SUGGESTED_THICKNESS_MM)
        self._shafts = Lines(view, "/plan/suggested_shafts", palette.ACCENT, THICKNESS_MM)

    def show(self, curve: Array, places: Array, directions: Array) -> None:
        """Draw a suggestion.

        curve (m, 3): positions along the path, empty to hide it. places, directions (n, 3): of its points. LPS mm.
        """
        self._curve.show(np.stack([curve[:-1], curve[1:]], axis=1) if len(curve) else _NOTHING)
        self._shafts.show(_rays(places, directions))

    def remove(self) -> None:
        self._curve.remove()
        self._shafts.remove()


def _rays(places: Array, directions: Array) -> Array:
    rays: Array = np.stack([places, places + LINE_MM * directions], axis=1)
    return rays
