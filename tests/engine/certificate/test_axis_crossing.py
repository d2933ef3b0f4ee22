"""The certificate alone, at a surface that nearly reaches the axis of a capsule: which side it is on is never lost."""

import numpy as np
import pytest

from vfix_engine.control import Controller, ControlSettings
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool


@pytest.mark.parametrize("gap", [1e-2, 2e-3, 9e-4, 5e-4, 2e-6, 5e-7])
def test_no_motion_takes_the_axis_through_a_surface(gap: float) -> None:
    """HAZ-01, HAZ-04: unsigned distance is the same on either side, so a way that may cross is not taken."""
    robot, tool = RobotModel.load("steady_hand"), Tool.load("straight_pointer")
    placed, q = robot.placed(np.eye(4), tool), robot.home
    pose = tool.segments(placed.tip(q).rotation, placed.tip(q).position)
    along = (pose.end[0] - pose.start[0]) / np.linalg.norm(pose.end[0] - pose.start[0])
    across = np.cross(along, [1.0, 0.0, 0.0])
    across /= np.linalg.norm(across)
    side = np.cross(across, along)
    middle = (pose.start[0] + pose.end[0]) / 2 - gap * across
    corners = [middle + 400 * (a * side + b * along) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    plate = ProximityTree(TriangleMesh(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])))
    controller = Controller(placed, tool, plate, ControlSettings())
    state = controller.measure(q)
    translate = placed.tip(q).jacobian[:3, :3]
    for factor in (-1.0, -0.1, 0.5, 1.0, 1.5, 2.0, 2.5, 10.0):
        step = np.zeros(len(q))
        step[:3] = np.linalg.solve(translate, -factor * gap * across)
        after = controller.certify(state, step)
        if after is not None:
            ends = np.concatenate([after.segments.start, after.segments.end])
            assert ((ends - middle) @ across > 0.0).all()
            assert after.clearance >= state.clearance
    away = np.zeros(len(q))
    away[:3] = np.linalg.solve(translate, 0.1 * across)
    assert (controller.certify(state, away) is not None) == (gap > 1e-3)
