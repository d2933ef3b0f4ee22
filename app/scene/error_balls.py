"""What targets may be off by behind a registration, as translucent balls about them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from app.scene import palette

if TYPE_CHECKING:
    from app.scene.view import SceneView

OPACITY = 0.25

Position = tuple[float, float, float]


class ErrorBalls:
    """One ball for each target, or none."""

    def __init__(self, view: SceneView, owner: str = "plan") -> None:
        """owner: the step that shows them; two of them have nodes of their own."""
        self._scene, self._owner = view.scene, owner
        self._nodes: list[Any] = []

    def show(self, balls: Sequence[tuple[Position, float]]) -> None:
        """balls: centre, LPS mm, and radius in mm."""
        self.remove()
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
        for node in self._nodes:
            node.remove()
        self._nodes = []
