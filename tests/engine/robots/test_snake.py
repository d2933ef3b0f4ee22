"""The snake: kinematics against Pinocchio and differences, vertices against the surface they stand for, refusals."""

import math
from dataclasses import FrozenInstanceError

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from vfix_engine.errors import RobotError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import SnakeModel
from vfix_engine.robots.snake_kernel import aim, snake_frames, snake_jacobian
from vfix_engine.robots.snake_surface import link_vertices, mesh_vertices

BASE = np.eye(4)
BASE[:3, :3] = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
BASE[:3, 3] = (120.0, -45.0, 310.0)


def universal(snake: SnakeModel) -> pin.Model:
    """The same robot built another way: Pinocchio's own universal joint, in mm, placed in the patient frame."""
    model, parent = pin.Model(), 0
    before = pin.SE3(BASE[:3, :3], BASE[:3, 3])
    for link in range(snake.links):
        joint = pin.JointModelUniversal(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
        parent = model.addJoint(parent, joint, before, f"universal{link}")
        before = pin.SE3(np.eye(3), np.array([0.0, 0.0, snake.length_mm]))
        model.addFrame(pin.Frame(f"end{link}", parent, 0, before, pin.FrameType.OP_FRAME))
    return model


@pytest.mark.parametrize(("links", "length"), [(1, 28.0), (5, 28.0), (30, 28.0), (5, 17.5)])
def test_frames_and_jacobians_are_pinocchios(links: int, length: float) -> None:
    snake = SnakeModel(links, length)
    model = universal(snake)
    data = model.createData()
    random = np.random.default_rng(links)
    for _ in range(20):
        q = random.uniform(-snake.q_max, snake.q_max, snake.dof)
        frames = snake.frames(q, BASE)
        assert frames.shape == (links + 1, 4, 4)
        np.testing.assert_array_equal(frames[0], BASE)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        link = int(random.integers(links))
        for i in range(links):
            frame = data.oMf[model.getFrameId(f"end{i}")].homogeneous
            np.testing.assert_allclose(frames[i + 1], frame, rtol=0.0, atol=2e-12)  # 30 links reach 840 mm
            np.testing.assert_allclose(frames[i + 1, :3, :3], frame[:3, :3], rtol=0.0, atol=2e-14)
        number, kind = model.getFrameId(f"end{link}"), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        theirs = pin.getFrameJacobian(model, data, number, kind)[:3]
        np.testing.assert_allclose(snake.point_jacobian(q, BASE, link, np.zeros(3)), theirs, atol=1e-9)
    np.testing.assert_array_equal(snake.tip(q, BASE), frames[-1])


def test_the_jacobian_is_the_slope_of_the_frames() -> None:
    """A thousand states of 5 and of 30 links, any point of any link, along a random motion of all joints."""
    step = 1e-5  # [rad] differences are good to about step² · 840 mm / 6 and 840 mm · 1e-16 / step, 1e-8 both
    random = np.random.default_rng(2)
    for links in (5, 30):
        plus, minus, frames = (np.empty((links, 3, 4)) for _ in range(3))
        jacobian = np.empty((3, 2 * links))
        for _ in range(500):
            q = random.uniform(-math.pi / 4, math.pi / 4, 2 * links)
            motion = random.uniform(-1.0, 1.0, 2 * links)
            point, link = random.uniform(-30.0, 30.0, 3), int(random.integers(links))
            snake_frames(q, BASE, 28.0, frames)
            x, y, z = frames[link, :, :3] @ point + frames[link, :, 3]
            snake_jacobian(frames, BASE, q, link, float(x), float(y), float(z), jacobian)
            snake_frames(q + step * motion, BASE, 28.0, plus)
            snake_frames(q - step * motion, BASE, 28.0, minus)
            slope = ((plus - minus) / (2.0 * step))[link]
            np.testing.assert_allclose(jacobian @ motion, slope[:, :3] @ point + slope[:, 3], atol=2e-6)
            assert not jacobian[:, 2 * link + 2 :].any()


def test_a_straight_snake_has_parallel_frames_and_its_reach() -> None:
    snake = SnakeModel(5)
    frames = snake.frames(np.zeros(10), np.eye(4))
    assert snake.reach_mm() == 140.0
    np.testing.assert_array_equal(frames[:, :3, :3], np.broadcast_to(np.eye(3), (6, 3, 3)))
    np.testing.assert_allclose(frames[:, 2, 3], np.arange(6) * 28.0, atol=0.0)
    camera = snake.camera(np.zeros(10), np.eye(4))
    np.testing.assert_array_equal(camera[:3, 3], [0.0, 0.0, 146.0])
    np.testing.assert_array_equal(camera[:3, :3], np.eye(3))


@pytest.mark.parametrize(("joint", "way"), [(0, (0.0, -1.0)), (1, (1.0, 0.0))])
def test_odd_joints_bend_in_one_plane_and_even_ones_across(joint: int, way: tuple[float, float]) -> None:
    """Of the paper's odd joints, ours 0, 2, …: about x, so a positive angle moves the tip to −y; even ones to +x."""
    q = np.zeros(10)
    q[joint::2] = math.radians(5.0)
    tip = SnakeModel(5).tip(q, np.eye(4))[:3, 3]
    # Five equal turns: the tip of a polygon of chords.
    angles = math.radians(5.0) * np.arange(1, 6)
    across, along = 28.0 * np.sin(angles).sum(), 28.0 * np.cos(angles).sum()
    np.testing.assert_allclose(tip, [way[0] * across, way[1] * across, along], atol=1e-12)


@given(st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0))
@settings(max_examples=200, deadline=None)
def test_aim_turns_the_link_to_the_direction(turn: float, height: float) -> None:
    across = math.sqrt(1.0 - height * height)
    wanted = np.array([height, across * math.cos(turn), across * math.sin(turn)])
    wanted /= np.linalg.norm(wanted)
    odd, even = aim(*(float(v) for v in wanted))
    reached = Rotation.from_euler("XY", [odd, even]).apply([0.0, 0.0, 1.0])
    np.testing.assert_allclose(reached, wanted, atol=1e-12)
    assert abs(even) <= math.pi / 2


def test_a_universal_joint_reaches_further_along_its_diagonals() -> None:
    """± 45° about both axes are 45° towards either axis and 60° between them: conformance makes use of it."""
    quarter = math.pi / 4
    for q, reach in (((quarter, 0.0), 45.0), ((0.0, quarter), 45.0), ((quarter, quarter), 60.0)):
        turned = SnakeModel(1).frames(q, np.eye(4))[1, 2, 2]
        assert math.degrees(math.acos(turned)) == pytest.approx(reach, abs=1e-12)


def test_it_moves_as_the_robot_model_made_of_it() -> None:
    snake = SnakeModel(16)
    robot = snake.robot_model()
    placed = robot.placed(BASE)
    assert len(robot.joints) == 32
    assert robot.notes == snake.assumed
    q = np.random.default_rng(5).uniform(robot.lower, robot.upper)
    tip, frame = placed.tip(q), snake.tip(q, BASE)
    np.testing.assert_allclose(tip.position, frame[:3, 3], atol=1e-10)
    np.testing.assert_allclose(tip.rotation[:, 1], frame[:3, 2], atol=1e-12)  # a tool's shaft, y, runs on along z
    np.testing.assert_allclose(tip.jacobian[:3], snake.point_jacobian(q, BASE, 15, np.zeros(3)), atol=1e-9)
    with pytest.raises(RobotError, match="34 joints"):
        SnakeModel(17).robot_model()


@given(st.integers(1, 40), st.integers(0, 3000))
@settings(max_examples=60, deadline=None)
def test_there_are_exactly_as_many_vertices_as_asked_for(links: int, more: int) -> None:
    points, start = SnakeModel(links).vertices(links + more)
    assert points.shape == (links + more, 3)
    assert start.dtype == np.int64
    assert start[0] == 0
    assert start[-1] == links + more
    of_link = np.diff(start)
    assert of_link.min() >= 1
    assert (np.diff(of_link) >= 0).all()
    assert of_link.max() - of_link.min() <= 1
    np.testing.assert_array_equal(points[start[1:] - 1], np.tile([0.0, 0.0, 6.0], (links, 1)))  # the poles


@pytest.mark.parametrize(
    ("radius", "sphere", "count"), [(6.0, None, 100), (6.0, 8.0, 100), (2.0, 2.0, 33), (12.0, 14.0, 2960)]
)
def test_vertices_are_on_the_union_and_leave_no_hole(radius: float, sphere: float | None, count: int) -> None:
    snake = SnakeModel(1, radius_mm=radius, sphere_radius_mm=sphere)
    points, ball = snake.vertices(count).points, snake.sphere_mm
    across, away = np.hypot(points[:, 0], points[:, 1]), np.linalg.norm(points, axis=1)
    on_cylinder = (abs(across - radius) < 1e-9) & (points[:, 2] >= -28.0) & (points[:, 2] <= 0.0)
    on_sphere = abs(away - ball) < 1e-9
    assert (on_cylinder | on_sphere).all()
    # Nothing inside the other: only what is the union's surface is sampled.
    assert (away >= ball - 1e-9).all()
    assert (across >= radius - 1e-9)[points[:, 2] < 0.0].all()
    # Other points of the same surface, drawn by rejection from the whole cylinder and the whole sphere.
    random = np.random.default_rng(count)
    turn = random.uniform(0.0, 2.0 * math.pi, 20_000)
    barrel = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), random.uniform(-28.0, 0.0, turn.size)])
    globe = random.normal(size=(20_000, 3))
    globe *= ball / np.linalg.norm(globe, axis=1)[:, None]
    barrel = barrel[np.linalg.norm(barrel, axis=1) >= ball]
    globe = globe[(np.hypot(globe[:, 0], globe[:, 1]) >= radius) | (globe[:, 2] >= 0.0)]
    waist = math.sqrt(ball**2 - radius**2)
    area = 2.0 * math.pi * (radius * (28.0 - waist) + ball * (ball + waist))
    spacing = math.sqrt(area / count)  # side of the square that a vertex stands for
    tree = cKDTree(points)
    assert max(tree.query(barrel)[0].max(), tree.query(globe)[0].max()) < 1.05 * spacing  # largest empty cap
    assert tree.query(points, k=2)[0][:, 1].min() > 0.65 * spacing  # and no two on one heap


@pytest.mark.parametrize("count", [5, 101, 503])
def test_vertices_of_a_mesh_cover_it_evenly(count: int) -> None:
    """Of a square tube, whose few large triangles have no vertex of their own where most of its surface is."""
    solid = trimesh.creation.box((10.0, 12.0, 28.0), trimesh.transformations.translation_matrix((0.0, 0.0, -14.0)))
    mesh = TriangleMesh(np.asarray(solid.vertices), np.asarray(solid.faces))
    points, start = mesh_vertices(mesh, 5, count)
    assert (len(points), start[-1]) == (count, count)
    assert set(np.diff(start)) <= {count // 5, count // 5 + 1}
    one = points[: start[1]]
    outside = np.abs(one - [0.0, 0.0, -14.0]) - [5.0, 6.0, 14.0]
    np.testing.assert_allclose(outside.max(axis=1), 0.0, atol=1e-9)  # on a face of the tube
    spacing = math.sqrt(solid.area / len(one))
    assert cKDTree(one).query(solid.sample(20_000, seed=count))[0].max() < 1.05 * spacing
    if len(one) > 1:
        assert cKDTree(one).query(one, k=2)[0][:, 1].min() > 0.65 * spacing
    np.testing.assert_array_equal(points[start[-2] :][: len(one)], one)  # the first ones of more
    assert one[0, 2] == pytest.approx(0.0)  # the foremost


def test_vertices_of_no_surface_are_refused() -> None:
    flat = TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(RobotError, match="no area"):
        mesh_vertices(flat, 1, 10)


def test_vertices_of_a_bent_snake_close_its_joints() -> None:
    """At ± 45° the rear rim of a link lies within the sphere of the link before it: no part of the robot is unseen."""
    snake = SnakeModel(2)
    turn = np.linspace(0.0, 2.0 * math.pi, 40)
    rim = np.column_stack([6.0 * np.cos(turn), 6.0 * np.sin(turn), np.full(40, -28.0)])
    for q in ((0.0, 0.0, 0.7, 0.7), (0.2, 0.1, -snake.q_max, snake.q_max)):
        frames = snake.frames(q, BASE)
        places = rim @ frames[2, :3, :3].T + frames[2, :3, 3]
        assert (np.linalg.norm(places - frames[1, :3, 3], axis=1) <= snake.sphere_mm + 1e-9).all()


def test_it_cannot_be_changed_and_its_vertices_are_kept() -> None:
    snake = SnakeModel(5)
    vertices = snake.vertices()
    assert len(vertices.points) == 500
    assert vertices is SnakeModel(5).vertices(500) is link_vertices(5, 500, 28.0, 6.0, 6.0)
    assert vertices.points.flags.c_contiguous
    for array in vertices:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(FrozenInstanceError):
        snake.links = 6  # type: ignore[misc]
    distal = SnakeModel(30, 25.0, radius_mm=5.0).distal(5)
    assert distal == SnakeModel(5, 25.0, radius_mm=5.0)
    assert any("mass" in word for word in snake.assumed)
    assert not SnakeModel(1, radius_mm=5.5, mass_kg=0.02, camera_offset_mm=4.0).assumed


def test_joints_are_clamped_to_their_range_and_not_to_less() -> None:
    snake = SnakeModel(2, q_max=0.5)
    assert snake.clamp([0.5, -0.5, 0.7, -3.0]).tolist() == [0.5, -0.5, 0.5, -0.5]
    assert snake.clamp([0.1, -0.2, 0.0, 0.49]).tolist() == [0.1, -0.2, 0.0, 0.49]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"links": 0}, "at least 1"),
        ({"links": 2.5}, "whole number"),
        ({"links": True}, "whole number"),
        ({"links": 100_000}, "at most 1,000"),
        ({"length_mm": 0.0}, "length_mm"),
        ({"length_mm": math.nan}, "length_mm"),
        ({"length_mm": "long"}, "must be a number"),
        ({"q_max": math.inf}, "q_max"),
        ({"q_max": math.pi / 2}, "below 90°"),
        ({"radius_mm": -1.0}, "radius_mm"),
        ({"radius_mm": 28.0}, "sphere < length"),
        ({"sphere_radius_mm": 5.0}, "radius ≤ sphere"),
        ({"mass_kg": 0.0}, "mass_kg"),
        ({"camera_offset_mm": -math.inf}, "camera_offset_mm"),
    ],
)
def test_a_snake_that_is_none_is_refused(wrong: dict[str, float], words: str) -> None:
    with pytest.raises(RobotError, match=words):
        SnakeModel(**({"links": 5} | wrong))  # type: ignore[arg-type]


def test_joints_bases_links_and_counts_that_are_none_are_refused() -> None:
    snake, q = SnakeModel(2), np.zeros(4)
    for joints in (np.zeros(3), np.zeros((2, 2)), [0.0, math.nan, 0.0, 0.0]):
        with pytest.raises(RobotError, match="4 finite joint angles"):
            snake.frames(joints, BASE)
        with pytest.raises(RobotError, match="4 finite joint angles"):
            snake.clamp(joints)
    far, flipped, sheared, tilted = (np.eye(4) for _ in range(4))
    far[0, 3], flipped[1, 1], sheared[0, 1], tilted[3, 0] = 2e6, -1.0, 1e-3, 1e-3
    for base in (np.eye(3), 2.0 * np.eye(4), np.full((4, 4), math.nan), far, flipped, sheared, tilted):
        with pytest.raises(RobotError, match=r"rigid|check the unit"):
            snake.frames(q, base)
    rounded = np.eye(4)
    rounded[0, 1] = 1e-7  # no more than a file with seven digits has
    np.testing.assert_array_equal(snake.frames(q, rounded)[0], rounded)
    for link in (-1, 2):
        with pytest.raises(RobotError, match=r"0 … 1"):
            snake.point_jacobian(q, BASE, link, np.zeros(3))
    with pytest.raises(RobotError, match="three finite"):
        snake.point_jacobian(q, BASE, 0, [0.0, math.inf, 0.0])
    for links in (0, 3):
        with pytest.raises(RobotError, match="has 2"):
            snake.distal(links)
    for count in (1, 10_000_001):
        with pytest.raises(RobotError, match="vertices"):
            snake.vertices(count)
