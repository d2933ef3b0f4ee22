"""The scene of one client: layers draw into it, and clicks and drags are reported as events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
import trimesh
import viser

from app.scene import camera
from app.scene.camera import Lens
from app.scene.checks import finite_numbers, finite_position
from app.scene.dragging import DragEvent
from app.scene.hand import GripDrag
from app.scene.labels import SceneLabels
from app.scene.lights import add_lights
from vfix_engine.arrays import Array

MAX_PIXELS = 1e5  # of a canvas along a side


@dataclass(frozen=True)
class ClickRay:
    """A click in the scene: a ray from the camera, LPS mm."""

    origin: Array
    direction: Array


@dataclass(frozen=True)
class SceneEvents:
    """Callbacks of the scene; they are called on viser's threads and must only queue the event."""

    clicked: Callable[[ClickRay], object]
    item_dragged: Callable[[DragEvent], object]
    grip_dragged: Callable[[GripDrag], object]
    camera_moved: Callable[[Lens], object]


class SceneView:
    """One viser client: its scene, its camera and its events. Not thread-safe: use it on one session's thread.

    labels: text labels, which the page may draw itself.
    lens: the camera last reported by the browser; None before the first report, or if that was invalid.
    atomic(): context in which changes reach the browser together. It holds back all other messages, so it should
    contain no computation. flush(): sends changes now instead of at the end of the current window of 1/60 s.
    """

    def __init__(self, client: viser.ClientHandle, events: SceneEvents) -> None:
        self._client, self.scene, self.events = client, client.scene, events
        self.labels = SceneLabels(self.scene)
        self.atomic, self.flush = client.atomic, client.flush
        client.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self.scene.set_up_direction("+z")
        add_lights(self.scene)
        # viser accepts coroutines too and keeps their order, though its annotation does not state it
        self.scene.on_click()(cast(Callable[[viser.SceneClickEvent], None], self._clicked))
        client.camera.on_update(self._camera_updated)
        self.lens = read_lens(client.camera) if client.camera._state.update_timestamp else None

    # -- the camera

    def look_from(self, pose: camera.CameraPose) -> None:
        handle = self._client.camera
        with self.atomic():
            handle.fov = camera.FIELD_OF_VIEW
            handle.near, handle.far = 1.0, 8000.0
            handle.up_direction = (0.0, 0.0, 1.0)
            handle.position = pose.position
            handle.look_at = pose.look_at

    async def _camera_updated(self, handle: viser.CameraHandle) -> None:
        self.lens = lens = read_lens(handle)
        if lens is not None:
            self.events.camera_moved(lens)

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        lens = self.lens
        place = finite_numbers(event.screen_pos, 2)
        if lens is None or lens.width <= 0 or lens.height <= 0 or place is None or np.abs(place - 0.5).max() > 0.5:
            return
        # viser reports the far corner of the pixel; its centre is half a pixel before
        x, y = place[0] - 0.5 / lens.width, place[1] - 0.5 / lens.height
        self.events.clicked(ClickRay(*lens.ray(x, y)))


def read_lens(handle: viser.CameraHandle) -> Lens | None:
    """Return the camera reported by the browser; None if its values are invalid."""
    wxyz, size = finite_numbers(handle.wxyz, 4), finite_numbers([handle.image_width, handle.image_height], 2)
    position, look_at = finite_position(handle.position), finite_position(handle.look_at)
    fov = finite_numbers([handle.fov], 1)
    if wxyz is None or size is None or position is None or look_at is None or fov is None:
        return None
    if not (0.0 < fov[0] < np.pi and 0.0 <= size.min() <= size.max() <= MAX_PIXELS):
        return None
    rotation = np.asarray(trimesh.transformations.quaternion_matrix(wxyz))[:3, :3]
    return Lens(rotation, position, look_at, float(fov[0]), int(size[0]), int(size[1]))
