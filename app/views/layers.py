"""Layers of the scene: what steps and views add to it, drawn again only where it has changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from app.scene.view import SceneView


class Nodes(Protocol):
    """Nodes of the scene that a layer owns."""

    def remove(self) -> None: ...


N = TypeVar("N", bound=Nodes)


@dataclass(frozen=True)
class Layer(Generic[N]):
    """One part of the scene.

    name: tells layers apart; two of one name must be of one kind of nodes. key: the nodes are shown again when it
    differs from the key of what was shown last. make: makes the nodes, once. show: brings them up to date.
    made_for: nodes that were made for something else are made anew.
    """

    name: str
    key: object
    make: Callable[[SceneView], N]
    show: Callable[[N], None]
    made_for: object = None


class LayerStack:
    """The layers that one client's scene shows now. Owned by the session's thread."""

    def __init__(self, view: SceneView) -> None:
        self.view = view
        self._drawn: dict[str, tuple[Layer[Any], Nodes]] = {}  # by name

    def draw(self, wanted: Iterable[Layer[Any]]) -> None:
        """Bring the scene up to date; of two layers with one name the later counts."""
        layers = {layer.name: layer for layer in wanted}
        for name, (shown, nodes) in tuple(self._drawn.items()):
            if name not in layers or layers[name].made_for != shown.made_for:
                del self._drawn[name]
                nodes.remove()
        for name, layer in layers.items():
            before = self._drawn.get(name)
            if before is not None and before[0].key == layer.key:
                continue  # a picture that stands still costs the browser nothing
            nodes = layer.make(self.view) if before is None else before[1]
            self._drawn[name] = layer, nodes  # also where showing fails: nodes that nobody knows would stay for ever
            layer.show(nodes)
