"""The planned directions of the shaft in the scene: lines at the path points, and the preview of a suggested path."""

from __future__ import annotations

from collections.abc import Sequence
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


@dataclass(frozen=True)
class ShaftHandle:
    """A planned direction as it is drawn, from a path point in LPS mm towards the tail; direction is a unit vector."""

    point_id: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    selected: bool

    @property
    def end(self) -> tuple[float, float, float]:
        """Position of the ball that it is dragged by, LPS mm."""
        x, y, z = (p + LINE_MM * d for p, d in zip(self.position, self.direction, strict=True))
        return (x, y, z)


class ShaftNodes:
    """A line at each point with a direction, from the tip towards the tail; the selected one is turned by a ball.

    The ball has a ring, since lines show through bone and balls do not.
    """

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._lines = Lines(view, "/plan/shafts", palette.UNKNOWN, THICKNESS_MM)
        self._ring = Lines(view, "/plan/shaft_ring", palette.ACCENT, THICKNESS_MM)
        self._balls: dict[str, DragBall] = {}

    def show(self, handles: Sequence[ShaftHandle], locked: bool) -> None:
        """Draw these directions and no others. locked: dragging is disabled."""
        self._lines.show(np.array([(one.position, one.end) for one in handles]).reshape(-1, 2, 3))
        with self._view.atomic():
            chosen = [one for one in handles if one.selected]
            self._ring.show(_rings([one.end for one in chosen]))
            for gone in self._balls.keys() - {one.point_id for one in chosen}:
                self._balls.pop(gone).remove()
            for one in chosen:
                if one.point_id not in self._balls:
                    name = f"/plan/shaft_{one.point_id}"
                    self._balls[one.point_id] = DragBall(
                        self._view.scene, name, HANDLE + one.point_id, BALL_MM, one.end, self._view.events.item_dragged
                    )
                self._balls[one.point_id].show(one.end, locked)

    def remove(self) -> None:
        self._lines.remove()
        self._ring.remove()
        for ball in self._balls.values():
            ball.remove()


class SuggestedNodes:
    """The preview of a suggested path and its directions."""

    def __init__(self, view: SceneView) -> None:
        self._curve = Lines(view, "/plan/suggested", palette.ACCENT, SUGGESTED_THICKNESS_MM)
        self._shafts = Lines(view, "/plan/suggested_shafts", palette.ACCENT, THICKNESS_MM)

    def show(self, curve: Array, places: Array, directions: Array) -> None:
        """Draw a suggestion.

        curve (m, 3): positions along the path, empty to hide it. places, directions (n, 3): of its points. LPS mm.
        """
        self._curve.show(np.stack([curve[:-1], curve[1:]], axis=1) if len(curve) else np.zeros((0, 2, 3)))
        self._shafts.show(_rays(places, directions))

    def remove(self) -> None:
        self._curve.remove()
        self._shafts.remove()


def _rays(places: Array, directions: Array) -> Array:
    rays: Array = np.stack([places, places + LINE_MM * directions], axis=1)
    return rays


def _rings(places: Sequence[tuple[float, float, float]]) -> Array:
    rings = [joined(ring(np.array(place), RING_MM)) for place in places]
    return np.concatenate(rings) if rings else np.zeros((0, 2, 3))
