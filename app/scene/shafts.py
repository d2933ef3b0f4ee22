"""The shaft's planned directions in the scene: quiet lines at the path points, and a suggested path as a preview."""

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


HANDLE = "shaft:"  # before the id of a path point, of the ball that its shaft is turned by
LINE_MM = 30.0  # of a direction, from the point towards the tail
BALL_MM = 0.9
RING_MM = 1.8  # around that ball, which bone may hide
THICKNESS_MM = 0.35
SUGGESTED_THICKNESS_MM = 1.0


@dataclass(frozen=True)
class ShaftHandle:
    """A planned direction as it is drawn, from a path point towards the tail; LPS mm, the direction of length 1."""

    point_id: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    selected: bool

    @property
    def end(self) -> tuple[float, float, float]:
        """Where the ball is that it is dragged by."""
        x, y, z = (p + LINE_MM * d for p, d in zip(self.position, self.direction, strict=True))
        return (x, y, z)


class ShaftNodes:
    """A line at each point that has a direction, from the tip towards the tail; at the selected one a ball turns it.

    The ball has a ring, since lines are seen through bone and balls are not.
    """

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._lines = Lines(view, "/plan/shafts", palette.UNKNOWN, THICKNESS_MM)
        self._ring = Lines(view, "/plan/shaft_ring", palette.ACCENT, THICKNESS_MM)
        self._balls: dict[str, DragBall] = {}

    def show(self, handles: Sequence[ShaftHandle], locked: bool) -> None:
        """locked: none can be dragged."""
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
    """A suggested path and its directions, before it is used."""

    def __init__(self, view: SceneView) -> None:
        self._curve = Lines(view, "/plan/suggested", palette.ACCENT, SUGGESTED_THICKNESS_MM)
        self._shafts = Lines(view, "/plan/suggested_shafts", palette.ACCENT, THICKNESS_MM)

    def show(self, curve: Array, places: Array, directions: Array) -> None:
        """curve: (m, 3) places along the path, none of them hides it; places, directions: (n, 3) of its points."""
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
