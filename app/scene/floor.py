"""The floor under a robot: a patch that fades out, with the shadow of the base."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import viser

from app.scene import shapes
from vfix_engine.arrays import Array
from vfix_engine.robots import Visual

PIXELS = 192
SPREAD = 3.2  # width of the floor relative to the base
FLOOR_GREY, FLOOR_ALPHA = 128.0, 0.34
SHADOW_ALPHA = 0.72
SHADOW_REACH = 1.5  # where the shadow ends, in half widths of the base
BELOW_MM = 0.5


@functools.lru_cache(maxsize=1)
def floor_picture() -> npt.NDArray[np.uint8]:
    """Return an image (PIXELS, PIXELS, 4) of a grey floor that fades out at the rim and is darkest in the middle."""
    axis = (np.arange(PIXELS) + 0.5) / PIXELS * 2.0 - 1.0
    away = np.hypot(*np.meshgrid(axis, axis))  # 1 at the rim
    floor = FLOOR_ALPHA * np.clip(1.0 - away, 0.0, 1.0) ** 0.8
    shadow = SHADOW_ALPHA * np.clip(1.0 - away * SPREAD / SHADOW_REACH, 0.0, 1.0)
    alpha = shadow + floor * (1.0 - shadow)
    grey = FLOOR_GREY * floor * (1.0 - shadow) / np.maximum(alpha, 1e-6)
    picture = np.stack([grey, grey, grey, 255.0 * alpha], axis=-1)
    return np.rint(picture).astype(np.uint8)


def footprint(visuals: Sequence[Visual]) -> tuple[Array, float] | None:
    """Return the centre (3,) of the underside of the base's visuals and their width, in mm in the base frame.

    None if the base has no visuals other than meshes.
    """
    corners = [_corners(visual) for visual in visuals if visual.link == 0 and visual.kind != "mesh"]
    if not corners:
        return None
    places = np.vstack(corners)
    low, high = places.min(axis=0), places.max(axis=0)
    middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2] - BELOW_MM])
    return middle, float(max(high[0] - low[0], high[1] - low[1]))


def _corners(visual: Visual) -> Array:
    radius = visual.size[0]
    half = {
        "box": np.array(visual.size) / 2.0,
        "cylinder": np.array([radius, radius, visual.size[1] / 2.0]),
        "sphere": np.full(3, radius),
    }[visual.kind]
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    return np.asarray((signs * half) @ np.asarray(visual.rotation).T + np.array(visual.position))


class FloorNodes:
    """The floor under a robot's base; nothing if `footprint` is None."""

    def __init__(self, scene: viser.SceneApi, visuals: Sequence[Visual]) -> None:
        self._node: viser.ImageHandle | None = None
        found = footprint(visuals)
        if found is None:
            return
        self._middle, width = found
        size = SPREAD * width
        self._node = scene.add_image(
            "/robot/floor", floor_picture(), size, size, format="png", cast_shadow=False, receive_shadow=False
        )

    def place(self, base: Array) -> None:
        """Move the floor under the base. base: transform_base_to_patient (4, 4), mm."""
        if self._node is None:
            return
        self._node.position = base[:3, :3] @ self._middle + base[:3, 3]
        self._node.wxyz = shapes.quaternion(base[:3, :3])

    def remove(self) -> None:
        if self._node is not None:
            self._node.remove()
