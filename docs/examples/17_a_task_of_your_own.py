"""A task of your own: objectives over the joints, in a class of a few lines; the certificate is the same for any task.

This one turns the tool about its shaft while the hand pushes it along, and a posture fills what both leave free.
"""

from dataclasses import dataclass

import numpy as np
import trimesh

from vfix_engine import (
    Controller,
    ControlSettings,
    HandCommand,
    ProximityTree,
    RobotModel,
    StepRequest,
    StepState,
    Tool,
    TriangleMesh,
    tasks,
)
from vfix_engine.virtual_fixtures import Objective


@dataclass(frozen=True)
class Drill:
    """The tool turns about its shaft at a speed in rad/s, as long as the hand pushes."""

    speed: float

    def request(self, state: StepState, command: HandCommand) -> StepRequest:
        shaft = state.tip.rotation[:, 1]
        matrix = np.append(shaft @ state.tip.jacobian[3:], 0.0)[None, :]  # over the joints and the progress variable
        turn = self.speed * settings.dt_s if np.any(command.force) else 0.0
        return StepRequest((Objective(matrix, np.array([turn]), weight=100.0),))  # (10 mm)²: what a radian is worth


settings = ControlSettings()
tunnel = trimesh.creation.annulus(r_min=8.0, r_max=11.0, height=60.0).subdivide_to_size(3.0)
tunnel.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))  # along the tool's shaft, y
robot, tool = RobotModel.load("steady_hand"), Tool.load("straight_pointer")
base = np.eye(4)
base[:3, 3] = -tool.tip_in_flange  # the tip begins at the origin
controller = Controller(
    robot.placed(base, tool), tool, ProximityTree(TriangleMesh(tunnel.vertices, tunnel.faces)), settings
)
state = controller.start(robot.home)
both = tasks.WeightedTasks([(tasks.MoveFreely(), 1.0), (Drill(1.0), 1.0)])
for _ in range(500):
    report = controller.step(
        state, [both, tasks.PostureTask(robot.home, weight=0.1)], HandCommand(np.array([0, 1.0, 0]))
    )
    state = report.state
print(f"turned by {state.q[-1]:.2f} rad, clearance {state.clearance:.2f} mm, {report.outcome}")
assert abs(state.q[-1]) > 0.1
assert state.clearance >= settings.margin_mm
