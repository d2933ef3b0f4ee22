"""Placing: every shipped robot drives a path; where its base stands; what a robot with too few joints is told."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.engine.robots.test_robot import SHIPPED, random_base
from tests.engine.scenes import CoalJudge, curved_tube
from tests.engine.urdf_texts import joint, links, urdf
from vfix_engine import Simulation
from vfix_engine.control import ControlSettings
from vfix_engine.errors import StartRefused
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.robots.inverse import inverse_kinematics
from vfix_engine.virtual_fixtures import Rows, Situation, StepState, Zone
from vfix_engine.worlds.rigid.base_placement import BasePlacement, tip_freedom
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.placing import Placing, place_robot
from vfix_engine.worlds.rigid.realtime import SceneSpec
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.scene import Scene

MESH, POINTS = curved_tube()
TREE = ProximityTree(MESH)
PATH = SplinePath(POINTS)


def place(robot: RobotModel, tool: str = "bent_30") -> Placing:
    return place_robot(TREE, robot, Tool.load(tool), PATH, ControlSettings())


@pytest.mark.parametrize("name", SHIPPED)
def test_every_robot_gets_to_the_end_of_the_tube(name: str) -> None:
    """HAZ-01: redundant and deficient ones, and coal finds the margin kept at the poses of the run."""
    robot, tool = RobotModel.load(name), Tool.load("bent_30")
    placing = place(robot)
    run, placed = placing.run, robot.placed(placing.base, tool)
    assert run.completed, run.reason
    np.testing.assert_allclose(placed.tip(placing.q_start).position, PATH.position(0.0), atol=1e-6)
    assert ((run.q >= robot.lower) & (run.q <= robot.upper)).all()
    judge = CoalJudge(MESH)
    for q in run.q[::40]:
        assert judge.clearance(tool.segments(*placed.tip_pose(q))) >= 0.3 - 1e-6


def test_a_robot_that_stands_already_keeps_its_base() -> None:
    """As behind a registration: only its joints are sought, and one that stands too far away is told which stops it."""
    robot, tool = RobotModel.load("steady_hand"), Tool.load("bent_30")
    base = place(robot).base.copy()
    base[:3, 3] += [4.0, -3.0, 2.0]
    placing = place_robot(TREE, robot, tool, PATH, ControlSettings(), base=base)
    assert placing.run.completed, placing.run.reason
    assert (placing.base == base).all()
    tip = robot.placed(base, tool).tip_pose(placing.q_start)[1]
    np.testing.assert_allclose(tip, PATH.position(0.0), atol=1e-5)
    base[:3, 3] += [500.0, 0.0, 0.0]
    with pytest.raises(StartRefused, match=r"from where it stands: joint .* at (its|their) limit"):
        place_robot(TREE, robot, tool, PATH, ControlSettings(), base=base)


@pytest.mark.parametrize("tool", ["straight_pointer", "shaver_40", "endoscope_45"])
def test_every_kind_of_tool_is_driven(tool: str) -> None:
    assert place(RobotModel.load("steady_hand"), tool).run.completed


@pytest.mark.parametrize("name", SHIPPED)
def test_the_tip_has_the_pose_that_was_asked_for(name: str) -> None:
    """T_base · FK(q) is the wanted pose; a robot that stands does so upright."""
    robot, tool = RobotModel.load(name), Tool.load("bent_30")
    stand = BasePlacement(robot, tool)
    forward = Rotation.from_euler("x", 8, degrees=True).as_matrix()  # the shaft, +y, into the head
    for roll in (-2.5, 0.0, 1.0, 3.0):
        wanted = forward @ Rotation.from_euler("y", roll).as_matrix()
        base, q = stand.at(wanted, np.array([10.0, -60.0, 20.0]), roll)
        tip = robot.placed(base, tool).tip(q)
        np.testing.assert_allclose(tip.rotation, wanted, atol=1e-7)
        np.testing.assert_allclose(tip.position, [10.0, -60.0, 20.0], atol=1e-5)
        assert ((q >= robot.lower) & (q <= robot.upper)).all()
        if robot.upright:
            np.testing.assert_allclose(base[:3, 2], [0.0, 0.0, 1.0], atol=1e-9)


def test_the_roll_is_made_by_the_joint_that_turns_the_shaft() -> None:
    """The Steady-Hand's base does not lean: only joint 7 is not at home, its base as upright as the shaft allows."""
    stand = BasePlacement(RobotModel.load("steady_hand"), Tool.load("bent_30"))
    rotation = Rotation.from_euler("y", 2.0).as_matrix()
    base, q = stand.at(rotation, np.zeros(3), 2.0)
    assert q.tolist() == [0, 0, 0, 0, 0, 0, 2.0]
    np.testing.assert_allclose(base[:3, :3], np.eye(3), atol=1e-12)
    psm = BasePlacement(RobotModel.load("dvrk_psm"), Tool.load("bent_30"))
    assert psm.at(rotation, np.zeros(3), 2.0)[1][3] == pytest.approx(2.0)


def test_a_pose_that_a_standing_arm_cannot_take_is_refused() -> None:
    """HAZ-04: straight up into the head is behind its wrist's range."""
    upwards = (
        Rotation.from_euler("x", 90, degrees=True).as_matrix() @ Rotation.from_euler("x", 60, degrees=True).as_matrix()
    )
    with pytest.raises(StartRefused, match="upright"):
        BasePlacement(RobotModel.load("arm_6"), Tool.load("bent_30")).at(upwards, np.zeros(3), 0.0)


def test_too_few_joints_are_told(tmp_path: Path) -> None:
    """A robot that moves its tip in a plane gets as far as that takes it, and the reason says so."""
    file = tmp_path / "two.urdf"
    limit = '<axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="1"/>'
    file.write_text(
        urdf(links("a", "b", "c"), joint("one", "a", "b", inside=limit), joint("two", "b", "c", inside=limit))
    )
    robot = RobotModel.load(file)
    assert tip_freedom(robot.placed(np.eye(4), Tool.load("bent_30")), robot.home) == 2
    placing = place(robot)
    assert not placing.run.completed
    assert "in 2 of 3 directions" in placing.run.reason
    simulation = Simulation(TREE, path=PATH, robot=robot)
    assert simulation.placing is not None
    assert simulation.placing.run.reason == placing.run.reason
    scene = Scene(TREE, robot, Tool.load("bent_30"), placing.base, placing.q_start, PATH)
    driven = HeadlessRun(Rehearsal(scene, ControlSettings()), lambda snapshot: None)
    assert driven.follow().phase != "done"
    assert driven.tally.steps < 5_000, "it was driven on although it got nowhere"


def test_a_simulation_places_its_robot_among_its_zones_and_fixtures() -> None:
    """As `place_robot` does with them, and not as it does without."""
    alone = Simulation(TREE, path=PATH)
    zone = Zone("where the shaft would be", Sphere(alone.now.segments_start[-1], 8.0), 1.0)
    among = Simulation(TREE, path=PATH, zones=[zone], fixtures=[Standing()])
    expected = place_robot(
        TREE, RobotModel.load("steady_hand"), Tool.load("bent_30"), PATH, ControlSettings(), (zone,), (Standing(),)
    )
    assert alone.placing is not None
    assert among.placing is not None
    np.testing.assert_array_equal(among.placing.base, expected.base)
    np.testing.assert_array_equal(among.q, expected.q_start)
    assert not np.array_equal(among.placing.base, alone.placing.base)
    assert (among.state.tool.distance[1] >= zone.margin_mm).all()
    assert Standing.asked > 0
    assert Simulation(TREE, base=alone.placing.base).placing is None


@dataclass(frozen=True)
class Standing:
    """A fixture that only counts how often it is asked."""

    asked: ClassVar[int] = 0

    def rows(self, now: Situation) -> Rows:
        Standing.asked += 1
        return Rows()

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        return True


@pytest.mark.parametrize("name", ["steady_hand", "dvrk_psm", "arm_6", "arm_7"])
def test_inverse_kinematics_finds_what_forward_kinematics_made(name: str) -> None:
    """From 20 places in the middle of the ranges, a nearby pose; and a pose out of reach has no joints."""
    random = np.random.default_rng(11)
    robot = RobotModel.load(name)
    placed = robot.placed(random_base(random), Tool.load("shaver_40"))
    for _ in range(20):
        start = robot.home + random.uniform(-0.2, 0.2, len(robot.joints)) * np.where(robot.revolute, 1.0, 50.0)
        goal = start + random.uniform(-0.15, 0.15, len(robot.joints)) * np.where(robot.revolute, 1.0, 50.0)
        rotation, position = placed.tip_pose(np.clip(goal, robot.lower, robot.upper))
        reached = inverse_kinematics(placed, rotation, position, start)
        assert reached.found
        q = reached.q
        found = placed.tip_pose(q)
        np.testing.assert_allclose(found[0], rotation, atol=1e-7)
        np.testing.assert_allclose(found[1], position, atol=2e-6)
        assert ((q >= robot.lower) & (q <= robot.upper)).all()
    assert not inverse_kinematics(placed, rotation, position + 5000.0, robot.home).found


def test_a_scene_in_another_process_may_name_files() -> None:
    """What the control process is sent names robot and tool; a path is a name as well."""
    folder = assets_dir()
    spec = SceneSpec(
        vertices=MESH.vertices,
        faces=MESH.faces,
        robot=str(folder / "robots" / "arm_7.json"),
        tool=str(folder / "tools" / "shaver_40.json"),
        base=np.eye(4),
        q_start=RobotModel.load("arm_7").home,
        path_points=POINTS,
        targets=np.zeros((0, 3)),
        target_names=(),
    )
    scene = spec.build()
    assert (scene.robot.name, scene.tool.name) == ("arm_7", "shaver_40")
    assert scene.placed_robot().dof == 7
