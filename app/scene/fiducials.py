"""Beads and points of a registration in the scene: balls in the colour of what is said of them, with their labels."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.scene import palette
from app.scene.labels import Label

if TYPE_CHECKING:
    from app.scene.view import SceneView

RADIUS_MM = 2.6
REJECTED_MM = 1.4
COLOURS = {"found": palette.FOUND_BEAD, "confirmed": palette.FIDUCIAL, "rejected": palette.UNKNOWN}


@dataclass(frozen=True)
class FiducialShape:
    """A ball as it is drawn, LPS mm. state: 'found', 'confirmed' or 'rejected'."""

    id: str
    label: str
    position: tuple[float, float, float]
    state: str
    selected: bool


class FiducialNodes:
    """All balls of the open registration."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._drawn: dict[FiducialShape, tuple[Any, Label]] = {}

    def show(self, shapes: Iterable[FiducialShape]) -> None:
        wanted = list(shapes)
        with self._view.atomic():
            for shape in [drawn for drawn in self._drawn if drawn not in wanted]:
                for node in self._drawn.pop(shape):
                    node.remove()
            for shape in wanted:
                if shape not in self._drawn:
                    self._drawn[shape] = self._made(shape)

    def _made(self, shape: FiducialShape) -> tuple[Any, Label]:
        name = f"/registration/{shape.id}_{shape.state}_{int(shape.selected)}"
        colour = palette.SELECTED if shape.selected else COLOURS[shape.state]
        ball = self._view.scene.add_icosphere(
            name,
            REJECTED_MM if shape.state == "rejected" else RADIUS_MM,
            subdivisions=3,
            color=colour,
            position=shape.position,
            cast_shadow=False,
            receive_shadow=False,
        )
        label = self._view.labels.add(
            f"{name}_label",
            shape.label,
            "item",
            np.array(shape.position) + np.array([0.0, 0.0, RADIUS_MM + 0.8]),
            visible=shape.state != "rejected" and bool(shape.label),
            font_screen_scale=0.8,
            anchor="bottom-left",
            depth_test=False,
        )
        return ball, label

    def remove(self) -> None:
        for nodes in self._drawn.values():
            for node in nodes:
                node.remove()
        self._drawn.clear()
