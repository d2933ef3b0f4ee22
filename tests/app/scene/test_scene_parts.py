"""Parts of the scene: camera, picking, colours, shapes, and the private names of viser that it uses."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
import viser

from app.scene import camera, palette, shapes
from app.scene.camera import Lens
from app.scene.error_balls import ErrorBalls
from app.scene.fiducials import FiducialNodes, FiducialShape
from app.scene.lines import GrowingLines
from app.scene.picking import PickingPlane, SurfacePicker, hit_items, hit_plane
from app.scene.tip_limits import tube_mesh
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.axes import rotation_z_to

VIEWS = ("anterior", "left", "right", "superior", "oblique", "nose")


def _lens(view: str) -> Lens:
    pose = camera.standard_view(view, np.array([5.0, -10.0, 20.0]), 100.0)
    forward = pose.look_at - pose.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=-1)  # OpenCV: x right, y down, z ahead
    return Lens(rotation, pose.position, pose.look_at, float(camera.FIELD_OF_VIEW), 900, 700)


@pytest.mark.parametrize("view", VIEWS)
def test_a_ray_meets_what_is_projected_onto_its_pixel(view: str) -> None:
    lens = _lens(view)
    rng = np.random.default_rng(1)
    for point in rng.uniform(-60.0, 60.0, (20, 3)):
        x, y = lens.project(point)[0]
        origin, direction = lens.ray(float(x), float(y))
        along = (point - origin) @ direction
        assert np.linalg.norm(origin + along * direction - point) < 1e-9


@pytest.mark.parametrize(
    ("view", "right_of_picture", "top_of_picture"),
    [
        ("anterior", (1, 0, 0), (0, 0, 1)),  # seen from the front, the patient's left is on the right
        ("left", (0, 1, 0), (0, 0, 1)),
        ("right", (0, -1, 0), (0, 0, 1)),
        ("superior", (-1, 0, 0), (0, -1, 0)),  # seen from above, the nose is up and the patient's right on the right
    ],
)
def test_standard_views_are_not_mirrored(
    view: str, right_of_picture: tuple[int, int, int], top_of_picture: tuple[int, int, int]
) -> None:
    """HAZ-14: left is left."""
    lens = _lens(view)
    centre = lens.project(lens.look_at)[0]
    assert centre == pytest.approx([0.5, 0.5])
    assert lens.project(lens.look_at + 30.0 * np.array(right_of_picture))[0][0] > 0.55
    assert lens.project(lens.look_at + 30.0 * np.array(top_of_picture))[0][1] < 0.45


def test_the_scale_is_that_of_the_place_looked_at() -> None:
    lens = _lens("anterior")
    a, b = lens.project(np.stack([lens.look_at, lens.look_at + np.array([10.0, 0.0, 0.0])]))
    assert (b[0] - a[0]) * lens.width * lens.view_height_mm / lens.height == pytest.approx(10.0)


def test_a_narrow_canvas_is_filled_by_the_width_of_what_is_shown() -> None:
    half = np.array([60.0, 30.0, 180.0])
    tall, ball = (camera.standard_view("anterior", np.zeros(3), size, (200, 700)) for size in (half, 180.0))
    away, ball_away = (float(np.linalg.norm(view.position)) for view in (tall, ball))
    view_height = 2.0 * away * np.tan(camera.FIELD_OF_VIEW / 2.0)
    assert away < 0.5 * ball_away
    assert view_height * 200 / 700 > 2.0 * half[0]
    assert view_height * (700 - 2 * camera.TOOLS_PX) / 700 > 2.0 * half[2]


def test_what_lies_behind_the_camera_has_no_place() -> None:
    lens = _lens("anterior")
    assert np.isnan(lens.project(2 * lens.position - lens.look_at)).all()


def test_a_click_meets_the_bone_that_is_shown() -> None:
    """The half that is cut away lets the click through to the other half."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=50.0)
    picker = SurfacePicker(TriangleMesh(ball.vertices, ball.faces))
    origin, direction = np.array([200.0, 1.0, 2.0]), np.array([-1.0, 0.0, 0.0])
    for cut, x in (("whole", 50.0), ("left", -50.0), ("right", 50.0)):
        hit = picker.hit(origin, direction, cut, 0.0)  # type: ignore[arg-type]
        assert hit is not None
        assert hit.position[0] == pytest.approx(x, abs=0.3)
        assert hit.distance_mm == pytest.approx(200.0 - x, abs=0.3)
    assert picker.hit(origin, -direction, "whole", 0.0) is None


def test_a_click_meets_a_slice_inside_its_picture_only() -> None:
    plane = PickingPlane(0, 4.0, np.array([[-10.0, -20.0, -30.0], [10.0, 20.0, 30.0]]))
    towards = np.array([-1.0, 0.0, 0.0])
    hit = hit_plane(np.array([100.0, 5.0, 6.0]), towards, plane)
    assert hit is not None
    assert hit.position == pytest.approx([4.0, 5.0, 6.0])
    assert hit_plane(np.array([100.0, 25.0, 6.0]), towards, plane) is None
    assert hit_plane(np.array([-100.0, 5.0, 6.0]), towards, plane) is None
    assert hit_plane(np.array([100.0, 5.0, 6.0]), np.array([0.0, 1.0, 0.0]), plane) is None


def test_a_click_takes_the_nearest_point() -> None:
    items = [
        ("far", np.array([0.0, 50.0, 0.0])),
        ("near", np.array([0.5, 20.0, 0.0])),
        ("aside", np.array([9.0, 1.0, 0.0])),
    ]
    hit = hit_items(np.zeros(3), np.array([0.0, 1.0, 0.0]), items, 1.0)
    assert hit is not None
    assert hit.item_id == "near"
    assert hit_items(np.zeros(3), np.array([0.0, -1.0, 0.0]), items, 1.0) is None


def test_clearance_colours_run_from_orange_to_blue() -> None:
    colours = palette.clearance_colours([-1.0, 0.0, 2.0, 99.0, np.nan]).astype(int)
    assert colours[0].tolist() == colours[1].tolist()
    assert colours[1][0] > colours[1][2] + 100, "no room is orange"
    assert colours[2][2] > colours[2][0] + 100, "much room is blue"
    assert colours[2].tolist() == colours[3].tolist()
    assert tuple(colours[4]) == palette.UNKNOWN
    every = palette.clearance_colours(np.linspace(0.0, 2.0, 200)).astype(int)
    nearest = np.abs(every - np.array(palette.UNKNOWN)).sum(axis=1).min()
    assert nearest > 150, "what is not reached looks like no clearance"


def test_a_capsule_runs_along_its_axis() -> None:
    vertices, faces = shapes.capsule(1.5, 40.0)
    assert vertices.min(axis=0) == pytest.approx([-1.5, -1.5, -1.5], abs=0.05)
    assert vertices.max(axis=0) == pytest.approx([1.5, 1.5, 41.5], abs=0.05)
    assert faces.max() < len(vertices)


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-0.3, 0.5, 0.8)])
def test_the_rotation_takes_z_to_the_direction(direction: tuple[float, float, float]) -> None:
    wanted = np.array(direction, dtype=np.float64)
    rotation = rotation_z_to(wanted)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert rotation[:, 2] == pytest.approx(wanted / np.linalg.norm(wanted))


def test_the_pinned_viser_still_has_the_names_that_are_relied_on() -> None:
    assert viser.__version__ == "1.1.1"
    assert "update_timestamp" in viser._viser._CameraHandleState.__dataclass_fields__
    assert hasattr(viser.SceneApi, "on_click")
    assert hasattr(viser.SceneNodeDragEvent, "__dataclass_fields__")


class _Drawn:
    """What is drawn of a scene: the calls that add nodes, by the nodes' names."""

    def __init__(self) -> None:
        self.scene, self.labels, self.calls = self, self, dict[str, dict[str, Any]]()

    def add_icosphere(self, name: str, *sizes: float, **fields: Any) -> Any:
        self.calls[name] = fields
        return SimpleNamespace(remove=lambda: None)

    def add_line_segments(self, name: str, points: Any, colour: Any, **fields: Any) -> Any:
        self.calls[name] = {"points": np.asarray(points), **fields}
        return SimpleNamespace(points=np.asarray(points), visible=True, remove=lambda: None)

    def add(self, name: str, *words: Any, **fields: Any) -> Any:
        return SimpleNamespace(remove=lambda: None)

    def atomic(self) -> Any:
        return nullcontext()


def test_balls_of_an_error_have_rings_in_mm_and_crosses_lines_in_pixels() -> None:
    """The page draws lines in mm through bone: targets lie behind it, crosses are as visible as their beads."""
    drawn: Any = _Drawn()
    ErrorBalls(drawn).show([((1.0, 2.0, 3.0), 0.5), ((9.0, 2.0, 3.0), 2.0)])
    rings = drawn.calls["/plan/error/rings"]
    assert rings["thickness_units"] == "world"
    reach = np.linalg.norm(rings["points"].reshape(2, -1, 3) - [[[1.0, 2.0, 3.0]], [[9.0, 2.0, 3.0]]], axis=-1)
    np.testing.assert_allclose(reach, np.broadcast_to([[0.5], [2.0]], reach.shape))
    FiducialNodes(drawn).show([FiducialShape("a", "F1", (0, 0, 0), "left_out", False, (1, 0, 0))])
    assert drawn.calls["/registration/a_left_out_0_measured"]["thickness_units"] == "screen"
    assert drawn.calls["/registration/a_left_out_0"]["color"] == palette.UNKNOWN


def test_a_tube_is_everything_within_its_radius_of_the_path() -> None:
    path = SplinePath(np.array([[0.0, 0.0, 0.0], [4.0, 10.0, 0.0], [0.0, 20.0, 6.0]]))
    vertices, faces = tube_mesh(path, 1.5)
    off = [float(np.linalg.norm(place - path.closest(place)[1])) for place in vertices.astype(float)]
    assert max(off) == pytest.approx(1.5, abs=1e-5)
    assert min(off) > 1.45
    mesh = trimesh.Trimesh(vertices, faces)  # merges the vertices of the poles
    mesh.update_faces(mesh.nondegenerate_faces())
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(np.pi * 1.5**2 * (path.length + 2.0), rel=0.03)


def test_lines_that_grow_are_taken_back_at_their_end() -> None:
    """The way of a tip in a replay that goes backwards."""
    shown: dict[str, Any] = {}

    def add(name: str, points: Any, *_: Any, **__: Any) -> Any:
        shown[name] = SimpleNamespace(points=np.asarray(points), visible=True)
        return shown[name]

    view: Any = SimpleNamespace(scene=SimpleNamespace(add_line_segments=add))
    lines, way = GrowingLines(view, "/way", (0, 0, 0), 1.0), np.arange(150 * 6, dtype=float).reshape(150, 2, 3)
    for count in (10, 150, 130, 70, 3, 0, 150, 64):
        lines.show(way[:count])
        drawn = [node.points for _, node in sorted(shown.items()) if node.visible]
        assert np.array_equal(np.concatenate([np.zeros((0, 2, 3)), *drawn]), way[:count]), count
