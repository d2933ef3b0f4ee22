"""The grip, the spring to the hand, the force arrow, the virtual point and the blocking place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from app.scene import palette
from app.scene.checks import finite_position
from app.scene.labels import SceneLabels
from vfix_engine.arrays import Array

GRIP_RADIUS_MM = 5.0
ARROW_MM_PER_N = 6.0
LABEL_RISE_MM = 9.0
SPRING_THICKNESS = 0.9  # mm, of the line from the tool to the hand


@dataclass(frozen=True)
class GripDrag:
    """A drag of the grip: phase 'start', 'update' or 'end', and the position of the hand, LPS mm.

    turns: with Shift held; where the mode has that, the hand turns the tool about its tip instead of moving it.
    """

    phase: str
    position: tuple[float, float, float]
    turns: bool = False


class HandNodes:
    """The grip that the user drags, and its forces. The ball follows the hand during a drag, otherwise the tool."""

    def __init__(self, scene: viser.SceneApi, labels: SceneLabels, on_drag: Callable[[GripDrag], object]) -> None:
        self._on_drag = on_drag
        self._grip_at = np.zeros(3)
        self._hand: Array | None = None  # position of the hand, set on viser's loop and read on the session's thread
        self._offset = np.zeros(3)
        self._mine = False
        self._ball = scene.add_icosphere(
            "/hand/grip", GRIP_RADIUS_MM, color=palette.GRIP_WATCHED, cast_shadow=False, receive_shadow=False
        )
        self._label = labels.add("/hand/label", "drag", "grip", font_screen_scale=0.85, anchor="bottom-center")
        line = np.zeros((1, 2, 3), dtype=np.float32)
        self._spring = scene.add_line_segments(
            "/hand/spring", line, palette.GRIP, thickness=SPRING_THICKNESS, visible=False
        )
        self._arrow = scene.add_arrows(
            "/hand/force", line, palette.FORCE, shaft_radius=0.7, head_radius=1.8, head_length=4.0, visible=False
        )
        self._view_point = scene.add_icosphere(
            "/hand/view_point", 0.8, color=palette.TARGET, cast_shadow=False, receive_shadow=False, visible=False
        )
        self._sight = scene.add_line_segments("/hand/sight", line, palette.TARGET, thickness=0.3, visible=False)
        self._blocked = scene.add_icosphere(
            "/hand/blocked",
            1.5,
            color=palette.BLOCKED,
            opacity=0.85,
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def show(self, grip: Array, force: Array, mine: bool) -> None:
        """Draw the grip.

        grip (3,): grip point on the tool, LPS mm. force (3,): force of the hand, N. mine: this tab controls the drive.
        """
        self._grip_at = grip
        if mine != self._mine:
            self._mine = mine
            self._ball.color = palette.GRIP if mine else palette.GRIP_WATCHED
            self._label.visible = mine
            if mine:
                self._ball.on_drag("left")(self._dragged)
                self._ball.on_drag("left", modifier="shift")(self._dragged)
            else:
                self._ball.remove_drag_callback("all")
                self._hand = None
        hand = self._hand
        ball = grip if hand is None else hand
        self._ball.position = ball
        self._label.position = ball + np.array([0.0, 0.0, LABEL_RISE_MM])
        self._label.visible = mine and hand is None
        self._spring.visible = hand is not None
        if hand is not None:
            self._spring.points = np.array([[grip, hand]], dtype=np.float32)
        size = float(np.linalg.norm(force))
        self._arrow.visible = size > 0.02
        if size > 0.02:
            start = ball + GRIP_RADIUS_MM * force / size  # at the ball's surface, so that it is visible
            self._arrow.points = np.array([[start, start + ARROW_MM_PER_N * force]], dtype=np.float32)

    def show_sight(self, tip: Array, view_point: Array | None) -> None:
        """Draw the virtual point ahead of the tip while a target is inspected; None hides it. Both (3,), LPS mm."""
        self._view_point.visible = self._sight.visible = view_point is not None
        if view_point is not None:
            self._view_point.position = view_point
            self._sight.points = np.array([[tip, view_point]], dtype=np.float32)

    def show_blocked(self, place: Array | None) -> None:
        """Draw the place of the obstacle that the tool waits at; the spring to the hand ahead of it is red then."""
        if (place is not None) != self._blocked.visible:
            colour = palette.GRIP if place is None else palette.BLOCKED
            self._spring.colors = np.full((1, 2, 3), colour, dtype=np.uint8)
            self._spring.thickness = SPRING_THICKNESS * (1.0 if place is None else 2.0)
        self._blocked.visible = place is not None
        if place is not None:
            self._blocked.position = place

    async def _dragged(self, event: viser.SceneNodeDragEvent[Any]) -> None:
        end = finite_position(event.end_position)
        if event.phase == "start" and end is not None:
            self._offset = self._grip_at - end
        position = None if end is None else finite_position(end + self._offset)
        if position is None:
            if event.phase != "end":
                return
            position = self._grip_at  # the end of a drag counts even with an invalid position
        self._hand = None if event.phase == "end" else position
        place = float(position[0]), float(position[1]), float(position[2])
        self._on_drag(GripDrag(event.phase, place, event.modifier == "shift"))

    def remove(self) -> None:
        for node in (self._ball, self._label, self._spring, self._arrow, self._view_point, self._sight, self._blocked):
            node.remove()
