"""Marks of the head's openings: a ring around each, across the way into it, and its name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from app.kit.values import Position
from app.scene import palette
from app.scene.labels import SceneLabel
from app.scene.lines import Lines, circle, joined

if TYPE_CHECKING:
    from app.scene.view import SceneView

AROUND_MM = 0.6  # from an opening's largest ball to its ring
LEAST_MM = 3.0  # radius of a ring
THICKNESS_MM = 0.7


@dataclass(frozen=True)
class OpeningMark:
    """An opening as it is drawn, LPS mm. side: 'left' or 'right' of the patient, or ''; inward: unit vector."""

    id: str
    name: str
    side: str
    position: Position
    inward: Position
    radius_mm: float


class OpeningNodes:
    """All marks, or none."""

    def __init__(self, view: SceneView) -> None:
        self._labels = view.labels
        self._rings = Lines(view, "/plan/openings", palette.ACCENT, THICKNESS_MM)
        self._names: list[SceneLabel] = []

    def show(self, openings: Iterable[OpeningMark]) -> None:
        """Draw these and no others."""
        self._clear()
        shown = list(openings)
        rings = [
            joined(circle(np.array(one.position), np.array(one.inward), max(one.radius_mm + AROUND_MM, LEAST_MM)))
            for one in shown
        ]
        self._rings.show(np.concatenate(rings) if rings else np.empty((0, 2, 3)))
        self._names = [
            self._labels.add(
                f"/plan/opening_{one.id}",
                one.name,
                f"opening {one.side}".strip(),
                one.position,
                font_screen_scale=0.8,
                anchor="center-left" if one.side != "right" else "center-right",
                depth_test=False,
            )
            for one in shown
        ]

    def remove(self) -> None:
        self._clear()
        self._rings.remove()

    def _clear(self) -> None:
        for label in self._names:
            label.remove()
        self._names = []
