"""Beads and points of a registration in the scene: balls coloured by their state, with labels.

The measured position of a point, transformed to the image, is a cross joined to its ball by a line: the residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.scene import palette
from app.scene.shape_nodes import ShapeNodes

if TYPE_CHECKING:
    pass

RADIUS_MM = 2.6
REJECTED_MM = 1.4
CROSS_MM = 3.2  # half the length of its lines, which extend beyond the ball
CROSS_PX = 2.0  # their thickness in pixels, since lines in mm would show through bone, unlike their ball and label
COLOURS = {
    "found": palette.FOUND_BEAD,
    "confirmed": palette.FIDUCIAL,
    "rejected": palette.UNKNOWN,
    "left_out": palette.UNKNOWN,
}


@dataclass(frozen=True)
class FiducialShape:
    """A ball as it is drawn, LPS mm. state: a key of COLOURS. measured: measured position in the image, or None."""

    id: str
    label: str
    position: tuple[float, float, float]
    state: str
    selected: bool
    measured: tuple[float, float, float] | None = None


class FiducialNodes(ShapeNodes[FiducialShape]):
    """All balls of the open registration."""

    def _made(self, shape: FiducialShape) -> tuple[Any, ...]:
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
            "bead chosen" if shape.selected else "bead",
            np.array(shape.position) + np.array([0.0, 0.0, RADIUS_MM + 0.8]),
            visible=shape.state != "rejected" and bool(shape.label),
            font_screen_scale=0.8,
            anchor="bottom-left",
            depth_test=False,
        )
        return (ball, label) if shape.measured is None else (ball, label, self._cross(name, shape))

    def _cross(self, name: str, shape: FiducialShape) -> Any:
        centre, ball = np.array(shape.measured), np.array(shape.position)
        arms = [[centre - arm, centre + arm] for arm in CROSS_MM * np.eye(3)]
        lines = np.array([*arms, [centre, ball]], dtype=np.float32)
        return self._view.scene.add_line_segments(
            f"{name}_measured",
            lines,
            palette.SELECTED if shape.selected else palette.MEASURED,
            thickness=CROSS_PX,
            thickness_units="screen",
        )
