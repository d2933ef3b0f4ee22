"""Line segments of the scene, which the page also shows faintly through bone, and rings made of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import viser

from vfix_engine.arrays import Array

if TYPE_CHECKING:
    from app.scene.view import SceneView


_CORNERS = 40  # of a ring
_CHUNK = 64  # segments of a node of lines that grow


class Lines:
    """A node of line segments, created with the first segments and hidden if there are none."""

    def __init__(self, view: SceneView, name: str, colour: tuple[int, int, int], thickness: float) -> None:
        """Create no node yet. thickness: mm."""
        self._scene, self._name, self._colour, self._thickness = view.scene, name, colour, thickness
        self._node: viser.LineSegmentsHandle | None = None

    def show(self, segments: Array) -> None:
        """Draw these segments. segments: (n, 2, 3), LPS mm."""
        if not len(segments):
            if self._node is not None:
                self._node.visible = False
            return
        if self._node is not None and len(segments) == len(self._node.points):
            self._node.points = segments.astype(np.float32)
            self._node.visible = True
            return
        self._node = self._scene.add_line_segments(
            self._name, segments, self._colour, thickness=self._thickness, thickness_units="world"
        )

    def remove(self) -> None:
        if self._node is not None:
            self._node.remove()


class GrowingLines:
    """Line segments that are added to at their end, or taken off there: in nodes of a few each, so that only those
    that change are sent again.
    """

    def __init__(self, view: SceneView, name: str, colour: tuple[int, int, int], thickness: float) -> None:
        """Create no node yet. thickness: mm."""
        self._view, self._name, self._look = view, name, (colour, thickness)
        self._nodes: list[Lines] = []
        self._count = 0  # of segments that are drawn

    def show(self, segments: Array) -> None:
        """Draw these segments, which begin with those drawn before or are the first of them. (n, 2, 3), LPS mm."""
        if len(segments) == self._count:
            return
        kept = min(len(segments), self._count)
        for number in range(kept // _CHUNK, -(-max(len(segments), self._count) // _CHUNK)):
            if number == len(self._nodes):
                self._nodes.append(Lines(self._view, f"{self._name}/{number}", *self._look))
            self._nodes[number].show(segments[number * _CHUNK : (number + 1) * _CHUNK])
        self._count = len(segments)

    def remove(self) -> None:
        for node in self._nodes:
            node.remove()


def ring(centre: Array, radius_mm: float) -> Array:
    """Return corners (n, 3) of a vertical and a horizontal circle, one of which is visible from every side."""
    angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
    zero, cosine, sine = np.zeros_like(angles), radius_mm * np.cos(angles), radius_mm * np.sin(angles)
    return np.vstack([centre + np.column_stack([cosine, zero, sine]), centre + np.column_stack([cosine, sine, zero])])


def circle(centre: Array, normal: Array, radius_mm: float) -> Array:
    """Return corners (n, 3) of a circle across a unit vector."""
    angles = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
    u = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    u = u / np.linalg.norm(u)
    found: Array = centre + radius_mm * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * np.cross(normal, u))
    return found


def joined(corners: Array) -> Array:
    """Return segments (n - 1, 2, 3) from each corner (n, 3) to the next one."""
    return np.stack([corners[:-1], corners[1:]], axis=1)
