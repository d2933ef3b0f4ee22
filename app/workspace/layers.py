"""Layers of the scene, added by tabs and workspace, drawn again only if changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from app.scene.view import SceneView


class LayerNodes(Protocol):
    """Nodes of the scene that a layer owns."""

    def remove(self) -> None: ...


N = TypeVar("N", bound=LayerNodes)


@dataclass(frozen=True)
class Layer(Generic[N]):
    """One part of the scene.

    name: identifies the layer; layers of one name must have one kind of nodes. key: the nodes are shown again when it
    differs from the key shown last. make: makes the nodes, once. show: updates them.
    made_for: nodes that were made for something else are made again.
    """

    name: str
    key: object
    make: Callable[[SceneView], N]
    show: Callable[[N], None]
    made_for: object = None


class LayerStack:
    """The present layers of one client's scene. Owned by the session's thread."""

    def __init__(self, view: SceneView) -> None:
        self.view = view
        self._drawn: dict[str, tuple[Layer[Any], LayerNodes]] = {}  # by name

    def draw(self, wanted: Iterable[Layer[Any]]) -> None:
        """Show exactly these layers; of two with one name the later takes precedence."""
        layers = {layer.name: layer for layer in wanted}
        for name in self._drawn.keys() - layers.keys():
            self._remove(name)
        self.update(layers.values())

    def update(self, changed: Iterable[Layer[Any]]) -> None:
        """Update these layers; the others stay unchanged."""
        for layer in changed:
            before = self._drawn.get(layer.name)
            if before is not None and before[0].made_for != layer.made_for:
                self._remove(layer.name)
                before = None
            if before is not None and before[0].key == layer.key:
                continue  # an unchanged picture costs the browser nothing
            nodes = layer.make(self.view) if before is None else before[1]
            self._drawn[layer.name] = layer, nodes  # also if showing fails: unknown nodes would stay forever
            layer.show(nodes)

    def _remove(self, name: str) -> None:
        self._drawn.pop(name)[1].remove()
