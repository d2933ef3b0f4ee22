"""The tube about a path that the tip of a tool stays in: a translucent surface with rings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from app.scene import palette
from app.scene.lines import Lines, circle, joined
from app.scene.view import SceneView
from vfix_engine.arrays import Array
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.transport import transported

OPACITY = 0.25
_RING_MM = 5.0  # between two drawn rings, which show through bone
_RING_THICKNESS_MM = 0.2
_STEP_MM = 1.0  # between two rings
_SIDES = 24
_CAP = 5  # rings of the half ball at an end


def tube_mesh(path: SplinePath, radius: float) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Vertices (n, 3) and faces (m, 3) of everything within a radius of a path, LPS mm, with half balls as ends.

    Where the path bends more closely than the radius, the surface passes through itself.
    """
    at = np.linspace(0.0, path.length, max(2, math.ceil(path.length / _STEP_MM) + 1))
    places, tangents = path.position(at), path.tangent(at)
    sides = transported(places, tangents)
    rise = np.linspace(0.0, 0.5 * np.pi, _CAP + 1)[1:]
    before, after = np.zeros(_CAP, np.intp), np.full(_CAP, len(at) - 1)
    ring = np.concatenate([before, np.arange(len(at)), after])  # the place that each ring is about
    share = np.concatenate([-np.sin(rise[::-1]), np.zeros(len(at)), np.sin(rise)])[:, None]  # of the radius, along it
    angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    across = np.cross(tangents, sides)
    around = np.cos(angle)[None, :, None] * sides[ring, None] + np.sin(angle)[None, :, None] * across[ring, None]
    width: Array = np.sqrt(np.maximum(1.0 - share * share, 0.0))
    off = share[:, None] * tangents[ring, None] + width[:, None] * around
    vertices = (places[ring, None] + radius * off).reshape(-1, 3).astype(np.float32)
    first = _SIDES * np.arange(len(ring) - 1)[:, None] + np.arange(_SIDES)
    second = _SIDES * np.arange(len(ring) - 1)[:, None] + (np.arange(_SIDES) + 1) % _SIDES
    quads = np.stack([first, second, second + _SIDES, first, second + _SIDES, first + _SIDES], axis=-1)
    return vertices, quads.reshape(-1, 3).astype(np.uint32)


class TubeNodes:
    """One tube: its surface, and rings about the path."""

    def __init__(self, view: SceneView) -> None:
        self._view = view
        self._surface: Any = None
        self._rings = Lines(view, "/rehearse/tube_rings", palette.ACCENT, _RING_THICKNESS_MM)

    def show(self, path: SplinePath, radius: float) -> None:
        """Draw a tube. radius: mm."""
        vertices, faces = tube_mesh(path, radius)
        at = np.linspace(0.0, path.length, max(2, round(path.length / _RING_MM) + 1))
        pairs = zip(path.position(at), path.tangent(at), strict=True)
        rings = [joined(circle(place, tangent, radius)) for place, tangent in pairs]
        with self._view.atomic():
            self._surface = self._view.scene.add_mesh_simple(
                "/rehearse/tube", vertices, faces, color=palette.ACCENT, opacity=OPACITY, side="double",
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            self._rings.show(np.concatenate(rings))

    def remove(self) -> None:
        if self._surface is not None:
            self._surface.remove()
        self._rings.remove()
