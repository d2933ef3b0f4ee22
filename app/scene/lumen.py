"""A robot's pathway through a lumen in the scene: its translucent wall, its contours and the centreline."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import viser

from app.scene import palette
from app.scene.lines import Lines, joined
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:
    from app.scene.view import SceneView

_LINE_MM, _RING_MM = 1.2, 0.4


class PathwayNodes:
    """One pathway. The wall is left out where the mesh is None."""

    def __init__(self, view: SceneView, mesh: TriangleMesh | None) -> None:
        self._line = Lines(view, "/route/centreline", palette.ACCENT, _LINE_MM)
        self._rings = Lines(view, "/route/contours", palette.ACCENT, _RING_MM)
        self._wall: viser.MeshHandle | None = None
        if mesh is not None:
            self._wall = view.scene.add_mesh_simple(
                "/route/pathway",
                np.asarray(mesh.vertices, dtype=np.float32),
                np.asarray(mesh.faces, dtype=np.uint32),
                color=palette.ACCENT,
                opacity=0.15,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )

    def show(self, centreline: Array, rings: list[Array]) -> None:
        """centreline (n, 3), rings: closed rims (m, 3) of contours, LPS mm."""
        self._line.show(joined(centreline))
        self._rings.show(np.concatenate([joined(ring) for ring in rings]) if rings else np.zeros((0, 2, 3)))

    def remove(self) -> None:
        self._line.remove()
        self._rings.remove()
        if self._wall is not None:
            self._wall.remove()
