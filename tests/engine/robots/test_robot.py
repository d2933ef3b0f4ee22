"""The Steady-Hand robot, and what every robot does: kinematics, tool in its hold, refusals (HAZ-06, HAZ-23)."""

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.errors import InputError, RobotError
from vfix_engine.geometry.shapes import Box
from vfix_engine.resources import assets_dir
from vfix_engine.robots import Joint, Mount, RobotModel, SnakeModel, Tool

ROBOT = RobotModel.load("steady_hand")
SNAKE = SnakeModel(4)
SHIPPED = sorted(path.stem for path in (assets_dir() / "robots").glob("*.json"))


def random_base(random: np.random.Generator) -> np.ndarray:
    base = np.eye(4)
    base[:3, :3] = Rotation.random(random_state=random.integers(2**31)).as_matrix()
    base[:3, 3] = random.uniform(-100, 100, 3)
    return base


def test_kinds_and_order_are_the_papers() -> None:
    """Joints 1, 2, 3, 6 prismatic, 4, 5, 7 revolute (Li 2007, section V.A)."""
    assert [j.kind[0] for j in ROBOT.joints] == list("ppprrpr")
    assert ROBOT.lower.tolist() == [-100, -100, -100, -1, -1, -120, -6.2] == (-ROBOT.upper).tolist()
    assert ROBOT.speed.tolist() == [60, 60, 60, 1, 1, 60, 2]


@pytest.mark.parametrize("name", SHIPPED)
def test_every_number_of_a_shipped_robot_has_a_source(name: str) -> None:
    robot = RobotModel.load(name)
    assert robot.name == name
    assert robot.source
    assert all(j.range_source != "URDF" for j in robot.joints)
    assert len({j.name for j in robot.joints}) == len(robot.joints)
    assert {v.link for v in robot.visuals} <= set(range(len(robot.joints) + 1))


@pytest.mark.parametrize("name", SHIPPED)
def test_every_joint_can_stop_a_slow_tool_at_once(name: str) -> None:
    """HAZ-06: from its top speed to a stop within 50 ms."""
    robot = RobotModel.load(name)
    assert (robot.speed / robot.acceleration <= 0.05 + 1e-12).all()


def test_the_urdf_moves_as_the_robot_that_is_written_by_hand() -> None:
    """Seven joints in one point: the product of their motions, to the last bit but rounding."""
    random = np.random.default_rng(0)
    placed = ROBOT.placed(np.eye(4))
    for _ in range(50):
        q = random.uniform(ROBOT.lower, ROBOT.upper)
        turn = Rotation.from_euler("ZX", q[3:5])
        rotation, position = placed.tip_pose(q)
        np.testing.assert_allclose(position, q[:3] + turn.apply([0.0, q[5], 0.0]), atol=1e-12)
        np.testing.assert_allclose(rotation, (turn * Rotation.from_euler("y", q[6])).as_matrix(), atol=1e-14)


def test_tip_stands_at_the_base_origin_with_the_shaft_along_y() -> None:
    base = random_base(np.random.default_rng(1))
    tip = ROBOT.placed(base).tip(np.zeros(7))
    np.testing.assert_allclose(tip.position, base[:3, 3])
    np.testing.assert_allclose(tip.rotation, base[:3, :3])


def test_the_two_rotations_cross_in_the_remote_centre() -> None:
    """At zero insertion yaw, pitch and roll leave the tip where it is."""
    placed = ROBOT.placed(np.eye(4))
    q = np.array([5.0, -4.0, 3.0, 0.4, -0.3, 0.0, 1.0])
    np.testing.assert_allclose(placed.tip(q).position, [5.0, -4.0, 3.0], atol=1e-12)


def test_link_placements_end_at_the_tip() -> None:
    placed = ROBOT.placed(np.eye(4))
    q = np.array([5.0, -4.0, 3.0, 0.4, -0.3, 20.0, 1.0])
    placements = placed.link_placements(q)
    assert placements.shape == (8, 4, 4)
    np.testing.assert_allclose(placements[-1][:3, 3], placed.tip(q).position)


def test_the_roll_turns_the_bend_about_the_shaft() -> None:
    """Joint 7 is about the tool's axis: the shaft stays where it is, the tip goes round it."""
    tool = Tool.load("bent_30")
    placed = ROBOT.placed(np.eye(4), tool)
    one, two = (tool.segments(*placed.tip_pose(np.array([0.0, 0, 0, 0, 0, 0, roll]))) for roll in (0.0, 1.3))
    np.testing.assert_allclose(one.start[1], two.start[1], atol=1e-9)
    np.testing.assert_allclose(one.end[1], two.end[1], atol=1e-9)
    assert np.linalg.norm(one.end[0] - two.end[0]) > 5.0


def test_a_tool_hangs_rigidly_in_the_frame_that_holds_it() -> None:
    """The tail stands in a frame off the last link, the shaft along that frame's y axis, wherever the joints are."""
    random = np.random.default_rng(4)
    mount = random_base(random)
    joints = (Joint("a", "revolute", (0.0, 0.0, 1.0), -1.0, 1.0, 1.0, 20.0, "test", random_base(random)),)
    robot, tool = RobotModel("r", "r", "test", joints, mount=Mount(mount, "tail")), Tool.load("shaver_40")
    placed = robot.placed(random_base(random), tool)
    q = np.array([0.7])
    flange = placed.link_placements(q)[-1] @ mount
    segments = tool.segments(*placed.tip_pose(q))
    np.testing.assert_allclose(segments.start[-1], flange[:3, 3], atol=1e-9)
    np.testing.assert_allclose(segments.end[-1], flange[:3, 3] + 110.0 * flange[:3, 1], atol=1e-9)


def changed(tmp_path: Path, change: Any) -> Path:
    """The Steady-Hand's configuration with something wrong in it, beside its URDF."""
    folder = assets_dir() / "robots"
    (tmp_path / "steady_hand.urdf").write_bytes((folder / "steady_hand.urdf").read_bytes())
    data = json.loads((folder / "steady_hand.json").read_text())
    change(data)
    file = tmp_path / "robot.json"
    file.write_text(json.dumps(data))
    return file


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda d: d["joints"]["z_stage"].update(lower=5, upper=-5), "z stage"),
        (lambda d: d["joints"]["y_stage"].update(upper=float("nan")), "NaN is no number"),
        (lambda d: d["joints"]["pitch"].update(speed=0), "pitch"),
        (lambda d: d["joints"]["pitch"].update(acceleration=-1), "pitch"),
        (lambda d: d["joints"]["pitch"].pop("acceleration"), "no acceleration"),
        (lambda d: d["joints"]["pitch"].pop("source"), "source"),
        (lambda d: d["joints"].update(elbow={}), "elbow"),
        (lambda d: d["joints"].update(yaw={"topspeed": 1}), "topspeed"),
        (lambda d: d["home"].update(yaw=3.0), "outside -1"),
        (lambda d: d["home"].update(yaw="much"), "much"),
        (lambda d: d["home"].update(yaw=10**400), "too large"),
        (lambda d: d.update(tool_frame="spoon"), "spoon"),
        (lambda d: d.update(base_frame="tool_holder", tool_frame="base"), "is not below"),
        (lambda d: d.update(base_frame="tool_holder"), "no joint"),
        (lambda d: d["tool_mount"].update(hold="wish"), "wish"),
        (lambda d: d["tool_mount"].update(xyz=[1, 2]), "usable"),
        (lambda d: d.update(stands="yes"), "true or false"),
        (lambda d: d.update(units={"length": "m", "angle": "rad"}), "mm and rad"),
        (lambda d: d.update(urdf="/etc/passwd"), "leads out"),
        (lambda d: d.update(urdf="../robot.urdf"), "leads out"),
        (lambda d: d.update(urdf="other.urdf"), "other"),
        (lambda d: d.pop("title"), "title"),
        (lambda d: d.update(colour="red"), "colour"),
        (lambda d: d.update(schema="vfix-robot/1"), "vfix-robot/2"),
    ],
)
def test_nonsense_configurations_are_refused_with_the_reason(tmp_path: Path, change: Any, word: str) -> None:
    """HAZ-23; a configuration may not lead out of its folder either (HAZ-19)."""
    with pytest.raises(RobotError, match=word):
        RobotModel.load(changed(tmp_path, change))


def test_unknown_names_say_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="steady_hand"):
        RobotModel.load("shaky_hand")
    with pytest.raises(RobotError, match=r"\.urdf"):
        RobotModel.load(tmp_path / "robot.stl")


@pytest.mark.parametrize("bad", [np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0]), np.full((4, 4), np.nan)])
def test_a_base_that_is_no_rigid_transform_is_refused(bad: np.ndarray) -> None:
    with pytest.raises(RobotError, match="rigid"):
        ROBOT.placed(bad)
    with pytest.raises(RobotError, match="rigid"):
        ROBOT.placed(np.eye(4), bad)


@pytest.mark.parametrize(("off", "fits"), [(0.9e-6, True), (1.1e-6, False), (1.05e-5, False)])
def test_robots_snakes_and_boxes_ask_for_the_same_rigidity(off: float, fits: bool) -> None:
    """One check with one absolute tolerance, on the diagonal of RᵀR as beside it."""
    stretched, sheared, tilted = np.eye(4), np.eye(4), np.eye(4)
    stretched[0, 0] = np.sqrt(1.0 + off)
    sheared[0, 1] = tilted[3, 0] = off
    for bad in (stretched, sheared, tilted):
        for build in (ROBOT.placed, lambda m: Box(m, [1.0, 1.0, 1.0]), lambda m: SNAKE.frames(np.zeros(SNAKE.dof), m)):
            with nullcontext() if fits else pytest.raises(InputError, match="rigid"):
                build(bad)
