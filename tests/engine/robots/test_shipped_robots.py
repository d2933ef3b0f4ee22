"""Kinematics of the shipped robots: Jacobians, compiled chain, references made elsewhere (HAZ-07)."""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from tests.engine.robots.test_robot import SHIPPED, random_base
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.robots.chain_kernel import forward

FLANGE_TO_FRAME = np.eye(4)  # back from the flange, whose y is the shaft's, to a tool frame whose z is
FLANGE_TO_FRAME[:3, :3] = Rotation.from_euler("x", -90, degrees=True).as_matrix()


@pytest.mark.parametrize("name", SHIPPED)
def test_jacobian_against_central_differences(name: str) -> None:
    """HAZ-07: 1000 states per robot, with a bent tool and any base, relative error below 1e-5."""
    random = np.random.default_rng(0)
    robot, step, worst = RobotModel.load(name), 1e-5, 0.0
    placed = robot.placed(random_base(random), Tool.load("shaver_40"))
    n = placed.dof
    for _ in range(1000):
        q = random.uniform(robot.lower, robot.upper)
        jacobian = placed.tip(q).jacobian
        numeric = np.zeros((6, n))
        for i, d in enumerate(step * np.eye(n)):
            (r1, p1), (r0, p0) = placed.tip_pose(q + d), placed.tip_pose(q - d)
            numeric[:3, i] = (p1 - p0) / (2 * step)
            turn = r1 @ r0.T  # so small that its skew part is its angle
            numeric[3:, i] = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        numeric[3:] /= 4 * step
        for rows in (slice(3), slice(3, 6)):
            worst = max(worst, np.abs(jacobian[rows] - numeric[rows]).max() / np.abs(numeric[rows]).max())
    assert worst < 1e-5


@pytest.mark.parametrize("name", SHIPPED)
def test_the_compiled_chain_is_pinocchios(name: str) -> None:
    """HAZ-07: to 1e-12 of the robot's size, for any base, any tool."""
    random = np.random.default_rng(1)
    robot = RobotModel.load(name)
    for tool in ("bent_30", "endoscope_70"):
        placed = robot.placed(random_base(random), Tool.load(tool))
        n = placed.dof
        rotation, position, jacobian = np.empty((3, 3)), np.empty(3), np.empty((6, n))
        for _ in range(50):
            q = random.uniform(robot.lower, robot.upper)
            forward(placed.chain, q, rotation, position, jacobian)
            tip = placed.tip(q)
            np.testing.assert_allclose(rotation, tip.rotation, atol=1e-12)
            np.testing.assert_allclose(position, tip.position, atol=1e-9)
            np.testing.assert_allclose(jacobian, tip.jacobian, atol=1e-9)


@pytest.mark.parametrize("file", sorted(path.name for path in (assets_dir() / "robots").glob("*.urdf")))
def test_our_reading_of_a_urdf_is_pinocchios_own(file: str) -> None:
    """HAZ-14: another reader of the same file, in metres, sees every joint where we see it."""
    path = assets_dir() / "robots" / file
    robot = RobotModel.load(path.with_suffix(".json"))
    model = pin.buildModelFromXML(path.read_text().split("\n", 1)[1])
    data = model.createData()
    placed = robot.placed(np.eye(4))
    random = np.random.default_rng(2)
    scale = np.where(robot.revolute, 1.0, 1e-3)
    np.testing.assert_allclose(robot.lower * scale, model.lowerPositionLimit)
    np.testing.assert_allclose(robot.upper * scale, model.upperPositionLimit)
    for _ in range(20):
        q = random.uniform(robot.lower, robot.upper)
        pin.forwardKinematics(model, data, q * scale)
        ours = placed.link_placements(q)
        for joint in range(1, model.njoints):
            np.testing.assert_allclose(ours[joint][:3, :3], data.oMi[joint].rotation, atol=1e-12)
            np.testing.assert_allclose(ours[joint][:3, 3] / 1e3, data.oMi[joint].translation, atol=1e-12)


@pytest.mark.parametrize(("frame", "key"), [("wrist_yaw", "T"), ("tool_tip", "T_with_tooltip")])
def test_the_psm_is_where_its_dh_numbers_put_it(trial_data: Path, frame: str, key: str) -> None:
    """HAZ-07: pose and Jacobian against a reference that was computed from the DH numbers elsewhere, in metres."""
    reference = json.loads((trial_data / "formats" / "robots" / "reference_psm_lnd_fk.json").read_text())
    robot = RobotModel.load("dvrk_psm", frame)
    placed = robot.placed(np.eye(4), FLANGE_TO_FRAME)
    scale = np.where(robot.revolute, 1.0, 1e3)
    assert len(reference["cases"]) >= 8
    for case in reference["cases"]:
        tip, expected = placed.tip(np.array(case["q"]) * scale), np.array(case[key])
        np.testing.assert_allclose(tip.rotation, expected[:3, :3], atol=1e-12)
        np.testing.assert_allclose(tip.position / 1e3, expected[:3, 3], atol=1e-12)
        jacobian = tip.jacobian * scale
        jacobian[:3] /= 1e3
        np.testing.assert_allclose(jacobian, case["jacobian_world_aligned_linear_then_angular"], atol=1e-12)
