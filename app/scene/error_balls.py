"""Error bounds of targets due to the registration, as translucent balls around them.

Targets lie inside the head, so each ball has a ring, which shows through bone as the path does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from app.kit.values import Position
from app.scene import palette
from app.scene.lines import Lines, joined, ring

if TYPE_CHECKING:
    from app.scene.view import SceneView

OPACITY = 0.25
RING_MM = 0.6  # thickness


class ErrorBalls:
    """One ball for each target, or none."""

    def __init__(self, view: SceneView, owner: str = "plan") -> None:
        """Create no balls yet. owner: name of the tab that shows them, each of which has its own nodes."""
        self._scene, self._owner = view.scene, owner
        self._nodes: list[Any] = []
        self._rings = Lines(view, f"/{owner}/error/rings", palette.ERROR_RING, RING_MM)

    def show(self, balls: Sequence[tuple[Position, float]]) -> None:
        """Draw these balls and no others. balls: centre in LPS mm and radius in mm of each."""
        self._clear()
        rings = [joined(ring(np.array(centre), radius)) for centre, radius in balls]
        self._rings.show(np.concatenate(rings) if rings else np.empty((0, 2, 3)))
        self._nodes = [
            self._scene.add_icosphere(
                f"/{self._owner}/error/{index}",
                radius=radius,
                color=palette.TARGET,
                opacity=OPACITY,
                position=centre,
                cast_shadow=False,
                receive_shadow=False,
            )
            for index, (centre, radius) in enumerate(balls)
        ]

    def remove(self) -> None:
        self._clear()
        self._rings.remove()

    def _clear(self) -> None:
        for node in self._nodes:
            node.remove()
        self._nodes = []
