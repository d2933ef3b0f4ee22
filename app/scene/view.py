"""One tab's scene: what to draw comes in as plain values, clicks and drags go out as plain events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt
import trimesh
import viser

from app.scene import camera
from app.scene.anatomy import BoneNode, LetterNodes, Look, SliceNodes, SlicePicture
from app.scene.camera import Lens
from app.scene.checks import finite_numbers, finite_position
from app.scene.hand import GripDrag, HandNodes
from app.scene.lights import add_lights
from app.scene.plan import DragEvent, PlanItem, PlanNodes
from app.scene.robot import RobotNodes, ToolNodes
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import Visual

Floats = npt.NDArray[np.float64]
MAX_PIXELS = 1e5  # of a canvas along a side


@dataclass(frozen=True)
class ClickRay:
    """A click in the scene: a ray from the camera, LPS mm."""

    origin: Floats
    direction: Floats


@dataclass(frozen=True)
class SceneEvents:
    """What the scene reports; each is called on viser's threads and must only queue."""

    clicked: Callable[[ClickRay], object]
    item_dragged: Callable[[DragEvent], object]
    grip_dragged: Callable[[GripDrag], object]
    camera_moved: Callable[[Lens], object]


class SceneView:
    """Draws into one viser client. Not thread-safe: one workspace thread calls it."""

    def __init__(self, client: viser.ClientHandle, events: SceneEvents) -> None:
        self._client, self._scene, self._events = client, client.scene, events
        self._bone: BoneNode | None = None
        self._letters: LetterNodes | None = None
        self._slices = SliceNodes(self._scene)
        self._plan = PlanNodes(self._scene, events.item_dragged)
        self._robot: RobotNodes | None = None
        self._tool: ToolNodes | None = None
        self._hand: HandNodes | None = None
        client.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self._scene.set_up_direction("+z")
        add_lights(self._scene)
        # viser takes coroutines here too, and keeps their order; its annotation does not say so
        self._scene.on_click()(cast(Callable[[viser.SceneClickEvent], None], self._clicked))
        client.camera.on_update(self._camera_updated)

    # -- the head

    def show_head(self, mesh: TriangleMesh, bounds: Floats, look: Look) -> None:
        """Draw a head anew; (2, 3) bounds place the letters."""
        self.clear()
        self._bone = BoneNode(self._scene, mesh)
        self._bone.show(look)
        self._letters = LetterNodes(self._scene, bounds)

    def show_look(self, look: Look) -> None:
        if self._bone is not None:
            self._bone.show(look)

    def show_slices(self, pictures: list[SlicePicture]) -> None:
        self._slices.show(pictures)

    def clear(self) -> None:
        """Take everything out, for another head."""
        self.hide_rehearsal()
        if self._bone is not None:
            self._bone.remove()
        if self._letters is not None:
            self._letters.remove()
        self._slices.remove()
        self._plan.remove()
        self._bone = self._letters = None
        self._slices = SliceNodes(self._scene)
        self._plan = PlanNodes(self._scene, self._events.item_dragged)

    # -- the plan

    def show_items(self, items: list[PlanItem], selected: str | None, locked: bool) -> None:
        with self._client.atomic():
            self._plan.show_items(items, selected, locked)

    def show_curve(self, points: Floats | None, clearance_mm: Floats | None) -> None:
        self._plan.show_curve(points, clearance_mm)

    def show_ghost(self, position: Floats | None, words: str = "") -> None:
        self._plan.show_ghost(position, words)

    # -- the rehearsal

    def show_rehearsal(
        self,
        visuals: tuple[Visual, ...],
        link_placements: Floats,
        tool: tuple[Floats, Floats, Floats],
        grip: Floats,
        force: Floats,
        mine: bool,
    ) -> None:
        """Robot parts on their links, tool capsules (start, end, radius), grip and force of the hand."""
        if self._robot is None or self._tool is None or self._hand is None:
            self._robot = RobotNodes(self._scene, visuals)
            self._tool = ToolNodes(self._scene)
            self._hand = HandNodes(self._scene, self._events.grip_dragged)
        with self._client.atomic():
            self._robot.place(link_placements)
            self._tool.place(*tool)
            self._hand.show(grip, force, mine)
        self._client.flush()

    def show_sight(self, tip: Floats, view_point: Floats | None) -> None:
        if self._hand is not None:
            self._hand.show_sight(tip, view_point)

    def show_blocked(self, place: Floats | None) -> None:
        if self._hand is not None:
            self._hand.show_blocked(place)

    def hand_moved(self) -> bool:
        """Whether the hand on the grip is elsewhere than it was last drawn."""
        return self._hand is not None and self._hand.moved()

    def hide_rehearsal(self) -> None:
        for part in (self._robot, self._tool, self._hand):
            if part is not None:
                part.remove()
        self._robot = self._tool = self._hand = None

    # -- the camera

    def look_from(self, pose: camera.CameraPose) -> None:
        handle = self._client.camera
        with self._client.atomic():
            handle.fov = camera.FIELD_OF_VIEW
            handle.near, handle.far = 1.0, 8000.0
            handle.up_direction = (0.0, 0.0, 1.0)
            handle.position = pose.position
            handle.look_at = pose.look_at

    def lens(self) -> Lens | None:
        """The browser's camera, None until it has reported."""
        handle = self._client.camera
        if handle._state.update_timestamp == 0.0:
            return None
        return read_lens(handle)

    async def _camera_updated(self, handle: viser.CameraHandle) -> None:
        lens = read_lens(handle)
        if lens is not None:
            self._events.camera_moved(lens)

    async def _clicked(self, event: viser.SceneClickEvent) -> None:
        lens = self.lens()
        place = finite_numbers(event.screen_pos, 2)
        if lens is None or lens.width <= 0 or lens.height <= 0 or place is None or np.abs(place - 0.5).max() > 0.5:
            return
        # viser reports the pixel's far corner; its centre lies half a pixel before
        x, y = place[0] - 0.5 / lens.width, place[1] - 0.5 / lens.height
        self._events.clicked(ClickRay(*lens.ray(x, y)))


def read_lens(handle: viser.CameraHandle) -> Lens | None:
    """The camera as the browser reported it; None when that is no camera."""
    wxyz, size = finite_numbers(handle.wxyz, 4), finite_numbers([handle.image_width, handle.image_height], 2)
    position, look_at = finite_position(handle.position), finite_position(handle.look_at)
    fov = finite_numbers([handle.fov], 1)
    if wxyz is None or size is None or position is None or look_at is None or fov is None:
        return None
    if not (0.0 < fov[0] < np.pi and 0.0 <= size.min() <= size.max() <= MAX_PIXELS):
        return None
    rotation = np.asarray(trimesh.transformations.quaternion_matrix(wxyz))[:3, :3]
    return Lens(rotation, position, look_at, float(fov[0]), int(size[0]), int(size[1]))
