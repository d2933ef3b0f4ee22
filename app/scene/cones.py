"""The directions from which a target can be inspected, as a translucent cone at the target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from app.scene import palette
from vfix_engine.arrays import Array

if TYPE_CHECKING:
    from app.scene.view import SceneView

OPACITY = 0.22
LENGTH_MM = 30.0
EDGE_MM = 0.25  # lines with a width in mm show through bone
_GENERATORS = 8  # lines from the target to the rim, at most

Surface = tuple[Array, npt.NDArray[np.intp]]


class ConeNodes:
    """The cone of one target, or nothing."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._nodes: list[Any] = []

    def show(self, surface: Surface | None, old: bool) -> None:
        """Draw a cone. surface: from `cone_surface`, apex first, LPS mm. old: of an earlier path, drawn grey."""
        self.remove()
        if surface is None or not len(surface[1]):
            return
        vertices, faces = surface
        colour = palette.UNKNOWN if old else palette.TARGET
        self._nodes = [
            self._scene.add_mesh_simple(
                "/plan/cone",
                vertices.astype(np.float32),
                faces.astype(np.uint32),
                color=colour,
                opacity=OPACITY,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            ),
            self._scene.add_line_segments(
                "/plan/cone_edges", cone_edges(vertices, faces), colour, thickness=EDGE_MM, thickness_units="world"
            ),
        ]

    def remove(self) -> None:
        for node in self._nodes:
            node.remove()
        self._nodes = []


def cone_edges(vertices: Array, faces: npt.NDArray[np.intp]) -> npt.NDArray[np.float32]:
    """Return the rim of a cone, and some lines from its apex to it, as segments (n, 2, 3)."""
    rim = faces[(faces == 0).any(axis=1)]
    rim = rim[rim != 0].reshape(-1, 2)
    some = np.unique(rim[:: max(1, -(-len(rim) // _GENERATORS)), 0])
    lines = np.stack([np.broadcast_to(vertices[0], (len(some), 3)), vertices[some]], axis=1)
    return np.concatenate([vertices[rim], lines]).astype(np.float32)
