"""A lumen's route in the scene: its pathway, the contour that is edited by hand, polyps and labels on the wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from app.kit.values import Position
from app.scene import palette
from app.scene.dragging import DragBall
from app.scene.lines import Lines, joined
from app.scene.shape_nodes import ShapeNodes
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:
    from app.scene.view import SceneView

_LINE_MM, _RING_MM, _CHOSEN_MM = 1.2, 0.4, 1.0
_HANDLE_MM = 3.5
_LABEL_RISE_MM = 1.5
CONTOUR = "contour"  # the item that is dragged


class PathwayNodes:
    """One pathway. Its surface is left out where the mesh is None: crossing the wall it is drawn in patches."""

    def __init__(self, view: SceneView, mesh: TriangleMesh | None = None) -> None:
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


class ContourNodes:
    """The contour that is edited by hand: its rim, a spoke to polar angle 0, and a ball that it is dragged by."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._rim = Lines(view, "/route/contour/rim", palette.SELECTED, _CHOSEN_MM)
        self._ball: DragBall | None = None

    def show(self, rim: Array, centre: Position, locked: bool) -> None:
        """rim (m, 3): closed, begins at polar angle 0; LPS mm. locked: it cannot be dragged."""
        self._rim.show(joined(np.concatenate([np.array(centre)[None], rim])))
        if self._ball is None:
            dragged = self._view.events.item_dragged
            self._ball = DragBall(self._view.scene, "/route/contour/handle", CONTOUR, _HANDLE_MM, centre, dragged)
        self._ball.show(centre, locked)

    def remove(self) -> None:
        self._rim.remove()
        if self._ball is not None:
            self._ball.remove()


class SeenWallNodes:
    """The part of the wall that the robot can view, tinted."""

    def __init__(self, view: SceneView, seen: TriangleMesh) -> None:
        self._node = view.scene.add_mesh_simple(
            "/route/seen",
            np.asarray(seen.vertices, dtype=np.float32),
            np.asarray(seen.faces, dtype=np.uint32),
            color=palette.SEEN_WALL,
            opacity=0.45,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def remove(self) -> None:
        self._node.remove()


@dataclass(frozen=True)
class MarkShape:
    """A polyp or a label as it is drawn: a ball that stands so many mm out of the wall at a place, LPS mm."""

    id: str
    name: str
    position: Position
    proud_mm: float
    colour: tuple[int, int, int]


class MarkNodes(ShapeNodes[MarkShape]):
    """Polyps and labels on the wall."""

    def _made(self, shape: MarkShape) -> tuple[Any, ...]:
        name = f"/route/marks/{shape.id}"
        ball = self._view.scene.add_icosphere(
            name, shape.proud_mm, subdivisions=3, color=shape.colour, position=shape.position, cast_shadow=False,
            receive_shadow=False,
        )  # fmt: skip
        above = np.array(shape.position) + np.array([0.0, 0.0, shape.proud_mm + _LABEL_RISE_MM])
        add, kind = self._view.labels.add, "bead inside"
        label = add(
            f"{name}_label", shape.name, kind, above, font_screen_scale=0.8, anchor="bottom-left", depth_test=False
        )
        return ball, label
