"""The Steady-Hand robot: kinematics, Jacobian and its data file (HAZ-07, HAZ-23)."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.errors import RobotError
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool

ROBOT = RobotModel.load("steady_hand")


def random_base(random: np.random.Generator) -> np.ndarray:
    base = np.eye(4)
    base[:3, :3] = Rotation.random(random_state=random.integers(2**31)).as_matrix()
    base[:3, 3] = random.uniform(-100, 100, 3)
    return base


def test_kinds_and_order_are_the_papers() -> None:
    """Joints 1, 2, 3, 6 prismatic, 4, 5, 7 revolute (Li 2007, section V.A)."""
    assert [j.kind[0] for j in ROBOT.joints] == list("ppprrpr")
    assert all(j.range_source for j in ROBOT.joints)


def test_every_joint_can_stop_a_slow_tool_at_once() -> None:
    """HAZ-06: from its top speed to a stop within 50 ms."""
    assert (ROBOT.speed / ROBOT.acceleration <= 0.05 + 1e-12).all()


def test_jacobian_against_central_differences() -> None:
    """HAZ-07: 1000 states with a tip off the flange, relative error below 1e-5."""
    random = np.random.default_rng(0)
    step = 1e-5
    worst = 0.0
    for _ in range(1000):
        placed = ROBOT.placed(random_base(random), random.uniform(-10, 10, 3))
        q = random.uniform(ROBOT.lower, ROBOT.upper)
        jacobian = placed.tip(q).jacobian
        numeric = np.zeros((6, placed.dof))
        for i in range(placed.dof):
            d = np.zeros(placed.dof)
            d[i] = step
            (r1, p1), (r0, p0) = placed.tip_pose(q + d), placed.tip_pose(q - d)
            numeric[:3, i] = (p1 - p0) / (2 * step)
            numeric[3:, i] = Rotation.from_matrix(r1 @ r0.T).as_rotvec() / (2 * step)
        worst = max(worst, np.abs(jacobian - numeric).max() / np.abs(numeric).max())
    assert worst < 1e-5


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
    placed = ROBOT.placed(np.eye(4), tool.tip_in_flange)
    one, two = (tool.segments(*placed.tip_pose(np.array([0.0, 0, 0, 0, 0, 0, roll]))) for roll in (0.0, 1.3))
    np.testing.assert_allclose(one.start[1], two.start[1], atol=1e-9)
    np.testing.assert_allclose(one.end[1], two.end[1], atol=1e-9)
    assert np.linalg.norm(one.end[0] - two.end[0]) > 5.0


def test_tool_segments_hang_together() -> None:
    tool = Tool.load("bent_30")
    rotation = Rotation.from_euler("xyz", [0.3, 0.2, -0.5]).as_matrix()
    position = np.array([1.0, 2.0, 3.0])
    segments = tool.segments(rotation, position)
    np.testing.assert_allclose(segments.end[0], position)
    np.testing.assert_allclose(segments.end[1], segments.start[0])
    np.testing.assert_allclose(np.linalg.norm(segments.end - segments.start, axis=1), [15.0, 150.0])
    shaft = (segments.end[1] - segments.start[1]) / 150.0
    assert np.degrees(np.arccos(shaft @ tool.direction(rotation))) == pytest.approx(30.0)
    grip = tool.grip(rotation, position)
    np.testing.assert_allclose(grip, segments.end[1] - 115.0 * shaft)
    np.testing.assert_allclose(segments.radius, [1.0, 1.5])


def changed(tmp_path: Path, change: Any) -> Path:
    data = json.loads((assets_dir() / "robots" / "steady_hand.json").read_text())
    change(data)
    file = tmp_path / "robot.json"
    file.write_text(json.dumps(data))
    return file


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda d: d["joints"][2].update(lower=5, upper=-5), "joint 3"),
        (lambda d: d["joints"][0].update(axis=[0, 0, 0]), "joint 1"),
        (lambda d: d["joints"][1].update(upper=float("nan")), "joint 2"),
        (lambda d: d["joints"][4].update(speed=0), "joint 5"),
        (lambda d: d["joints"][4].update(acceleration=-1), "joint 5"),
        (lambda d: d["joints"][4].update(kind="screw"), "screw"),
        (lambda d: d["joints"][0].pop("axis"), "axis"),
        (lambda d: d["visuals"][0].update(link=99), "99"),
        (lambda d: d.update(schema="urdf"), "vfix-robot/1"),
    ],
)
def test_nonsense_robots_are_refused_with_the_reason(tmp_path: Path, change: Any, word: str) -> None:
    """HAZ-23."""
    with pytest.raises(RobotError, match=word):
        RobotModel.load(changed(tmp_path, change))


def test_unknown_names_say_what_there_is() -> None:
    with pytest.raises(RobotError, match="steady_hand"):
        RobotModel.load("shaky_hand")
    with pytest.raises(RobotError, match="bent_30"):
        Tool.load("spoon")


@pytest.mark.parametrize("bad", [np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0]), np.full((4, 4), np.nan)])
def test_a_base_that_is_no_rigid_transform_is_refused(bad: np.ndarray) -> None:
    with pytest.raises(RobotError, match="rigid"):
        ROBOT.placed(bad)
