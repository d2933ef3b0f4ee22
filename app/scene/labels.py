"""Text labels of the scene: drawn by the page over the scene's frame, or otherwise by viser."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from vfix_engine.arrays import Array


class SceneLabel:
    """A text at a position in LPS mm.

    kind: style on the page ('letter', 'item', 'bead', 'bead chosen', 'grip', 'centre', 'stop', 'gap', 'opening',
    and that with its side; 'bead inside': seen through what is around it, from every side).
    """

    def __init__(self, node: viser.LabelHandle, kind: str, text: str, visible: bool, owner: SceneLabels) -> None:
        self.kind = kind
        self._node, self._owner = node, owner
        self._text, self._visible = text, visible
        self._position = np.zeros(3)

    @property
    def text(self) -> str:
        return self._text

    @text.setter
    def text(self, text: str) -> None:
        self._text = self._node.text = text

    @property
    def position(self) -> Array:
        return self._position

    @position.setter
    def position(self, position: npt.ArrayLike) -> None:
        self._position = np.array(position, dtype=np.float64)
        self._node.position = self._position

    @property
    def visible(self) -> bool:
        return self._visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._visible = visible
        self.refresh()

    def refresh(self) -> None:
        """Show viser's text, or hide it if the page draws the labels."""
        shown = self._visible and not self._owner.by_page
        if self._node.visible != shown:
            self._node.visible = shown

    def remove(self) -> None:
        self._owner.forget(self)
        self._node.remove()


class SceneLabels:
    """All labels of one client's scene. by_page: the page draws them, and viser's texts are hidden."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._add: Callable[..., viser.LabelHandle] = scene.add_label
        self._known: dict[int, SceneLabel] = {}
        self.by_page = False

    def add(
        self,
        name: str,
        text: str,
        kind: str,
        position: npt.ArrayLike = (0.0, 0.0, 0.0),
        visible: bool = True,
        **options: Any,
    ) -> SceneLabel:
        """Add a label. options: options of viser for its own text."""
        shown = visible and not self.by_page
        label = SceneLabel(self._add(name, text, visible=shown, **options), kind, text, visible, self)
        label.position = np.asarray(position)
        self._known[id(label)] = label
        return label

    def forget(self, label: SceneLabel) -> None:
        self._known.pop(id(label), None)

    def leave_to_page(self, by_page: bool) -> None:
        self.by_page = by_page
        for label in self._known.values():
            label.refresh()

    def shown(self) -> list[SceneLabel]:
        """Return the visible labels in the order of their creation."""
        return [label for label in self._known.values() if label.visible]
