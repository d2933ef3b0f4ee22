"""Imported structures of a case in the scene: one coloured surface each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import viser

from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:
    from app.scene.view import SceneView


@dataclass(frozen=True, eq=False)
class StructureShape:
    """A structure as it is drawn. colour: '#rrggbb'. shown: visible; a hidden structure keeps its nodes."""

    id: str
    colour: str
    shown: bool
    mesh: TriangleMesh


class StructureNodes:
    """The surfaces of structures, by id."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._nodes: dict[str, viser.MeshHandle] = {}
        self._colours: dict[str, str] = {}

    def show(self, shapes: Sequence[StructureShape]) -> None:
        """Draw these structures and no others."""
        for gone in self._nodes.keys() - {shape.id for shape in shapes}:
            self._nodes.pop(gone).remove()
            self._colours.pop(gone)
        for shape in shapes:
            if shape.id not in self._nodes and shape.shown:
                self._nodes[shape.id] = self._made(shape)
                self._colours[shape.id] = shape.colour
            if shape.id in self._nodes:
                self._nodes[shape.id].visible = shape.shown
                if self._colours[shape.id] != shape.colour:
                    self._nodes[shape.id].color = _rgb(shape.colour)
                    self._colours[shape.id] = shape.colour

    def _made(self, shape: StructureShape) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            f"/head/{shape.id}",
            np.asarray(shape.mesh.vertices, dtype=np.float32),
            np.asarray(shape.mesh.faces, dtype=np.uint32),
            color=_rgb(shape.colour),
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def remove(self) -> None:
        for node in self._nodes.values():
            node.remove()


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue
