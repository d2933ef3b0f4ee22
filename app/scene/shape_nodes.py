"""Shapes in the scene that are drawn anew only where one has changed."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from app.scene.view import SceneView

S = TypeVar("S", bound=Hashable)


class ShapeNodes(Generic[S]):
    """Nodes of shapes, of which equal ones stay as they are."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._drawn: dict[S, tuple[Any, ...]] = {}

    def show(self, shapes: Iterable[S]) -> None:
        wanted = list(shapes)
        with self._view.atomic():
            for shape in [drawn for drawn in self._drawn if drawn not in wanted]:
                for node in self._drawn.pop(shape):
                    node.remove()
            for shape in wanted:
                if shape not in self._drawn:
                    self._drawn[shape] = self._made(shape)

    def _made(self, shape: S) -> tuple[Any, ...]:
        """The nodes of a shape."""
        raise NotImplementedError

    def remove(self) -> None:
        for nodes in self._drawn.values():
            for node in nodes:
                node.remove()
        self._drawn.clear()
