"""A picture of the snake in its lumen: the whole colon, the last links, and what the camera at the tip sees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ....arrays import Array
from ....geometry.mesh import TriangleMesh
from ....pathway.packed import PackedPathway
from ....robots.snake import SnakeModel
from ....snake import NOTICE
from .camera_view import FIELD_DEG, Picture, PinholeCamera, RayHits, RayMesh, endoscope_view
from .picture_marks import INK, MARK, PAPER, RIM, draw_compass, draw_line, draw_marks, draw_scale, rims, write
from .robot_shape import robot_shape

WIDTH, HEIGHT = 600, 760  # [px] of a panel
_HEAD = 64  # [px] height of the strip with the words above the panels
_CAMERA = 560  # [px] of the camera's picture, which is square
_LAYERS = 4  # number of translucent walls behind each other
_AHEAD_MM, _BEHIND_MM = 70.0, 60.0  # length of lumen shown ahead of the tip and behind the displayed links
_SHOWN, _DRAWN = 6, 8  # distal links that frame the close view, and those that are drawn there
_RINGS_MM = 7.0  # minimum distance of drawn contours
_FRUSTUM_MM = 30.0
_NOTICE = 14  # [px] of the notice from the lower edge
_WALL = np.array([0.42, 0.47, 0.56])
_DISTAL, _BODY = np.array([0.88, 0.22, 0.06]), np.array([0.98, 0.70, 0.18])


class LumenPictures:
    """Draws pictures of one lumen.

    Args:
        mesh: the lumen's surface in the patient frame, mm.
        landmarks: name → place (3,) mm; named in the whole view.
    """

    def __init__(self, mesh: TriangleMesh, landmarks: Mapping[str, ArrayLike] | None = None) -> None:
        self._mesh = mesh
        self._surface = RayMesh(mesh)
        self._landmarks = {name: np.array(place, dtype=np.float64) for name, place in (landmarks or {}).items()}
        self._whole = _whole_view(mesh)
        self._whole_layers: list[RayHits] | None = None
        self._centroids = mesh.triangles.mean(axis=1)

    def draw(
        self,
        name: str,
        snake: SnakeModel,
        q: ArrayLike,
        base: ArrayLike,
        packed: PackedPathway,
        distal: int = 5,
        words: Sequence[str] = (),
    ) -> Picture:
        """One picture (H, W, 3) uint8 of the snake at joints q (2L,) and a base (4, 4).

        Args:
            name: of the position; a landmark of that name is ringed.
            packed: the pathway at this moment.
            distal: number of links bent by the operator; they have their own colour.
            words: lines below the camera's picture, five at most; every picture has the notice below them.
        """
        frames = snake.frames(q, base)
        picture = np.full((HEIGHT + _HEAD, 3 * WIDTH, 3), PAPER, dtype=np.uint8)
        picture[_HEAD:, :WIDTH] = self._draw_whole(name, _robot(snake, frames, distal, 0), packed)
        picture[_HEAD:, WIDTH : 2 * WIDTH] = self._draw_close(name, snake, frames, distal, packed)
        picture[_HEAD:, 2 * WIDTH :] = self._draw_camera(snake, frames, q, base, words)
        _write_head(picture, name, distal)
        return picture

    def _draw_whole(self, name: str, robot: tuple[RayMesh, Array], packed: PackedPathway) -> Picture:
        view = self._whole
        if self._whole_layers is None:
            self._whole_layers = self._surface.layers(view, _LAYERS)
        seen = robot[0].first(view)
        picture = _through_walls(self._whole_layers, seen, robot[1])
        centre, _ = _contours(packed)
        draw_line(picture, view, centre, RIM, hidden_by=seen.distance)
        draw_marks(picture, view, self._landmarks, {one: _readable(one) for one in self._landmarks}, name)
        draw_compass(picture, view)
        draw_scale(picture, view, float(np.linalg.norm(self._mesh.bounds.mean(axis=0) - view.eye)), 100.0)
        return picture

    def _draw_close(self, name: str, snake: SnakeModel, frames: Array, distal: int, packed: PackedPathway) -> Picture:
        shown = min(snake.links, _SHOWN)
        joints = frames[-shown - 1 :, :3, 3]
        centre, rim = _contours(packed)
        near = _around_tip(centre, frames[-1, :3, 3], shown * snake.length_mm + _BEHIND_MM)
        part = np.isin(cKDTree(centre).query(self._centroids)[1], near)
        eye, corners = _frustum(snake, frames)
        view = _close_view(joints, np.concatenate([rim[near].reshape(-1, 3), corners]))
        walls = RayMesh(TriangleMesh(self._mesh.vertices, self._mesh.faces[part])).layers(view, 3) if part.any() else []
        robot, tint = _robot(snake, frames, distal, max(snake.links - _DRAWN, 0))
        seen = robot.first(view)
        picture = _through_walls(walls, seen, tint)
        apart = float(np.linalg.norm(centre[near[-1]] - centre[near[0]])) / max(len(near) - 1, 1)
        for one in rim[near][:: max(round(_RINGS_MM / max(apart, 1e-6)), 1)]:
            draw_line(picture, view, one, RIM, hidden_by=seen.distance)
        for corner in corners:
            draw_line(picture, view, [eye, corner], MARK)
        draw_line(picture, view, [*corners, corners[0]], MARK)
        if name in self._landmarks:
            draw_marks(picture, view, {name: self._landmarks[name]}, {name: _readable(name)}, name)
        draw_compass(picture, view)
        draw_scale(picture, view, float(np.linalg.norm(joints.mean(axis=0) - view.eye)), 20.0)
        return picture

    def _draw_camera(
        self,
        snake: SnakeModel,
        frames: Array,
        q: ArrayLike,
        base: ArrayLike,
        words: Sequence[str],
    ) -> Picture:
        panel = np.full((HEIGHT, WIDTH, 3), PAPER, dtype=np.uint8)
        view = PinholeCamera.with_field(snake.camera(q, base), _CAMERA, _CAMERA)
        others: list[tuple[RayMesh, ArrayLike | None]] = [(self._surface, None)]
        if snake.links > 1:  # the last link carries the camera and is not in its picture
            others.append((RayMesh(robot_shape(snake, frames, 0, snake.links - 1)[0]), _BODY))
        inset = (WIDTH - _CAMERA) // 2
        seen = endoscope_view(others, view)
        if not seen.any():
            write(seen, "no wall in sight: the camera looks out of the lumen", (20, 40), 0.5, PAPER)
        panel[inset : inset + _CAMERA, inset : inset + _CAMERA] = seen
        for number, line in enumerate(words):
            write(panel, line, (inset, inset + _CAMERA + 34 + 26 * number), 0.5)
        write(panel, NOTICE, (inset, HEIGHT - _NOTICE), 0.5, halo=True)
        return panel


def _robot(snake: SnakeModel, frames: Array, distal: int, first: int) -> tuple[RayMesh, Array]:
    """The links from ``first`` on, and the colour (F, 3) of each triangle; neighbours differ a little."""
    body, link = robot_shape(snake, frames, first, snake.links)
    tint = np.where((link >= snake.links - distal)[:, None], _DISTAL, _BODY)
    return RayMesh(body), tint * np.where(link % 2 == snake.links % 2, 1.0, 0.82)[:, None]


def _readable(name: str) -> str:
    return name.replace("_", " ")


def _through_walls(walls: list[RayHits], robot: RayHits, tint: Array) -> Picture:
    """The robot behind and before translucent walls, which are darker where they are seen edge-on."""
    colour = np.zeros((*robot.distance.shape, 3))
    left = np.ones(robot.distance.shape)  # light that is not absorbed yet
    for wall in walls:
        before = wall.distance < robot.distance
        stopped = np.where(before, 0.05 + 0.55 * (1.0 - wall.facing) ** 3, 0.0) * left
        colour += stopped[..., None] * _WALL
        left -= stopped
    solid = np.isfinite(robot.distance)
    shade = (0.35 + 0.65 * robot.facing)[..., None] * tint[robot.triangle]
    colour += left[..., None] * np.where(solid[..., None], shade, 1.0)
    left = np.where(solid, 0.0, left)
    # Only walls in front of the robot count.
    return np.rint(255.0 * np.clip(colour, 0.0, 1.0)).astype(np.uint8)


def _looking(eye: Array, ahead: Array, up: Array) -> Array:
    """A camera's pose (4, 4) at ``eye``, looking along ``ahead``, with ``up`` upwards in the picture."""
    z = ahead / np.linalg.norm(ahead)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, np.cross(z, x), z, eye
    return pose


def _whole_view(mesh: TriangleMesh) -> PinholeCamera:
    """From the front, from so far away that perspective is negligible; the head is up."""
    low, high = mesh.bounds
    middle, size = 0.5 * (low + high), high - low
    distance = 5.0 * float(size.max())
    pose = _looking(middle - np.array([0.0, distance, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    near = distance - 0.5 * float(size[1])
    focal = 0.88 * near * min(WIDTH / float(size[0]), HEIGHT / float(size[2]))
    return PinholeCamera(pose, WIDTH, HEIGHT, focal)


def _close_view(joints: Array, around: Array) -> PinholeCamera:
    """Onto the plane in which the last links extend most, with the head up as far as possible."""
    middle = joints.mean(axis=0)
    thinnest = np.linalg.svd(joints - middle)[2][2]
    ahead = thinnest if thinnest[1] >= 0.0 else -thinnest  # prefer the front to the back
    up = np.array([0.0, 0.0, 1.0]) if abs(ahead[2]) < 0.9 else np.array([0.0, -1.0, 0.0])
    distance = 5.0 * float(np.linalg.norm(joints - middle, axis=1).max())
    middle = 0.5 * (around.min(axis=0) + around.max(axis=0))
    view = PinholeCamera(_looking(middle - distance * ahead, ahead, up), WIDTH, HEIGHT, 1.0)
    spread = np.abs(view.project(around)[0] - 0.5 * np.array([WIDTH, HEIGHT])).max(axis=0)
    focal = 0.86 * float(min(0.5 * WIDTH / spread[0], 0.5 * HEIGHT / spread[1]))
    return PinholeCamera(view.transform_camera_to_patient, WIDTH, HEIGHT, focal)


def _contours(packed: PackedPathway) -> tuple[Array, Array]:
    """Centres and rims without the first and last, which only lengthen the pathway beyond the lumen."""
    centre, rim = rims(packed)
    return (centre[1:-1], rim[1:-1]) if len(centre) > 3 else (centre, rim)


def _around_tip(centre: Array, tip: Array, behind_mm: float) -> NDArray[np.int64]:
    """Numbers of the contours along the last links and a little ahead."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(centre, axis=0), axis=1))])
    here = along[np.linalg.norm(centre - tip, axis=1).argmin()]
    return np.flatnonzero((along >= here - behind_mm) & (along <= here + _AHEAD_MM))


def _frustum(snake: SnakeModel, frames: Array) -> tuple[Array, Array]:
    """The camera's position (3,) and the corners (4, 3) of its field of view 30 mm ahead."""
    x, y, z, tip = frames[-1, :3].T
    eye = tip + snake.camera_offset_mm * z
    half = _FRUSTUM_MM * np.tan(0.5 * np.radians(FIELD_DEG))
    sides = ((-half, -half), (half, -half), (half, half), (-half, half))
    return eye, np.array([eye + _FRUSTUM_MM * z + across * x + down * y for across, down in sides])


def _write_head(picture: Picture, name: str, distal: int) -> None:
    titles = (
        (f"At {_readable(name)}", "whole lumen from the front; line: the pathway's centre"),
        (
            f"The last links ({distal} bent by the operator: red)",
            "rings: some contours of the pathway; pyramid: the camera's view",
        ),
        ("What the camera sees", f"field of view {FIELD_DEG:g} degrees, light at the lens"),
    )
    for number, (title, below) in enumerate(titles):
        write(picture, title, (number * WIDTH + 20, 28), 0.65, INK, bold=True)
        write(picture, below, (number * WIDTH + 20, 52), 0.45, INK)
    for number in (1, 2):
        picture[:, number * WIDTH] = (210, 214, 220)
