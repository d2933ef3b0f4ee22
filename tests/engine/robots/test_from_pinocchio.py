"""Robots from Pinocchio models, and the weights of joints."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from vfix_engine import RobotModel, Tool
from vfix_engine.errors import RobotError
from vfix_engine.resources import assets_dir
from vfix_engine.virtual_fixtures import joint_regularisation

URDF = assets_dir() / "robots" / "arm_7.urdf"
FRAME = json.loads((assets_dir() / "robots" / "arm_7.json").read_text(encoding="utf-8"))["tool_frame"]


@pytest.fixture(scope="module")
def model() -> pin.Model:
    return pin.buildModelFromUrdf(str(URDF))


def test_it_is_the_robot_of_the_urdf(model: pin.Model) -> None:
    """Limits, speeds, and the tip at random joints, in mm."""
    plain, made = RobotModel.load(URDF, FRAME), RobotModel.from_pinocchio(model, FRAME)
    for name in ("lower", "upper", "speed", "revolute", "joint_weights"):
        np.testing.assert_allclose(getattr(made, name), getattr(plain, name), rtol=1e-12, err_msg=name)
    tool, random = Tool.load("bent_30"), np.random.default_rng(1)
    one, two = (robot.placed(np.eye(4), tool) for robot in (plain, made))
    for _ in range(20):
        q = random.uniform(plain.lower, plain.upper)
        for a, b in zip(one.tip_pose(q), two.tip_pose(q), strict=True):
            np.testing.assert_allclose(b, a, atol=1e-9)
    assert any("has no acceleration" in note for note in made.notes)


def test_joints_off_the_chain_are_left_out_and_weights_are_named(model: pin.Model) -> None:
    third = next(f.name for f in model.frames if f.parentJoint == 3 and f.type == pin.FrameType.BODY)
    made = RobotModel.from_pinocchio(model, third, weights={model.names[3]: 7.0})
    assert [joint.name for joint in made.joints] == list(model.names)[1:4]
    assert made.joint_weights.tolist() == [50.0, 50.0, 7.0]


def test_prismatic_joints_come_in_mm() -> None:
    model = pin.Model()
    limits = [np.array([value]) for value in (1.0, 0.06, -0.1, 0.2)]  # N, m/s, m, m
    placement = pin.SE3(np.eye(3), np.array([0.01, 0.0, 0.0]))
    joint = model.addJoint(0, pin.JointModelPZ(), placement, "lift", *limits)
    model.addFrame(pin.Frame("flange", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    (made,) = RobotModel.from_pinocchio(model, "flange").joints
    assert (made.kind, made.axis, made.lower, made.upper) == ("prismatic", (0.0, 0.0, 1.0), -100.0, 200.0)
    assert (made.speed, made.acceleration, made.unit) == (60.0, 1200.0, "mm")
    assert made.placement[0, 3] == pytest.approx(10.0)


def test_a_joint_without_limits() -> None:
    for kind, told in ((pin.JointModelRUBZ(), None), (pin.JointModelPZ(), "has no limits; set lowerPositionLimit")):
        model = pin.Model()
        joint = model.addJoint(0, kind, pin.SE3.Identity(), "j")
        model.addFrame(pin.Frame("flange", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
        if told is not None:
            with pytest.raises(RobotError, match=told):
                RobotModel.from_pinocchio(model, "flange")
            continue
        robot = RobotModel.from_pinocchio(model, "flange")
        assert robot.upper[0] == pytest.approx(16 * np.pi)
        assert any("eight turns either way" in note for note in robot.notes)


def test_what_is_no_chain_is_refused(model: pin.Model) -> None:
    with pytest.raises(RobotError, match="no frame 'nowhere'"):
        RobotModel.from_pinocchio(model, "nowhere")
    with pytest.raises(RobotError, match="a weight is given for 'elbow'"):
        RobotModel.from_pinocchio(model, FRAME, weights={"elbow": 1.0})
    ball = pin.Model()
    joint = ball.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    ball.addFrame(pin.Frame("flange", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    with pytest.raises(RobotError, match="'ball' is a JointModelSpherical"):
        RobotModel.from_pinocchio(ball, "flange")


def test_weights_are_the_robots_data(tmp_path: Path) -> None:
    """A configuration's own; 1 and 50 where there is none, whichever joint comes last."""
    assert RobotModel.load("steady_hand").joint_weights.tolist() == [1.0, 1.0, 1.0, 50.0, 50.0, 1.0, 20.0]
    assert RobotModel.load(URDF, FRAME).joint_weights.tolist() == [50.0] * 7
    rows = joint_regularisation(RobotModel.load("steady_hand")).matrix
    np.testing.assert_array_equal(np.diag(rows[:, :7]), 0.01 * np.array([1.0, 1.0, 1.0, 50.0, 50.0, 1.0, 20.0]))
    data = json.loads((assets_dir() / "robots" / "arm_7.json").read_text(encoding="utf-8"))
    (tmp_path / "arm_7.urdf").write_bytes(URDF.read_bytes())
    for weight in (0.0, -1.0):
        data["joints"]["turn"]["weight"] = weight
        (tmp_path / "arm.json").write_text(json.dumps(data), encoding="utf-8")
        with pytest.raises(RobotError, match=r"weight .* must be a finite number above 0"):
            RobotModel.load(tmp_path / "arm.json")
