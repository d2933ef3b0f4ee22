"""One control step in three functions: build the problem, solve it, certify the motion.

The controller does these three a thousand times a second; here they stand alone, with nothing hidden between them.
"""

import numpy as np
import trimesh

from vfix_engine import (
    ControlContext,
    ControlSettings,
    RobotModel,
    Tool,
    TriangleMesh,
    build_step,
    certify_step,
    solve_step,
)
from vfix_engine.control import Certified, HandCommand
from vfix_engine.control.tasks import MoveFreely
from vfix_engine.proximity.proximity import ProximityTree

tunnel = trimesh.creation.annulus(r_min=12.0, r_max=15.0, height=80.0).subdivide_to_size(3.0)
tunnel.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))  # along the tool's shaft, y
anatomy, robot, tool = (
    ProximityTree(TriangleMesh(tunnel.vertices, tunnel.faces)),
    RobotModel.load("steady_hand"),
    Tool.load("bent_30"),
)
base = np.eye(4)
base[:3, 3] = -tool.tip_in_flange  # the tip begins at the origin
context = ControlContext(robot.placed(base, tool), tool, anatomy, ControlSettings())
state = context.measure(robot.home)
for _ in range(100):
    problem = build_step(state, [MoveFreely()], [], HandCommand(force=np.array([0.0, 2.0, 0.0])))  # rows, with names
    solution = solve_step(problem)  # checked: nothing violated, multipliers balance the gradient
    verdict = certify_step(problem, solution.dq)  # the whole motion, not only where it ends
    assert isinstance(verdict, Certified), f"refused by {verdict.by}"
    state = verdict.next_state
print(f"{len(problem.rows)} rows, such as '{problem.rows[0].name}' in {problem.rows[0].unit}")
print(f"the tip is at {state.tip.position.round(3)}, clearance {state.clearance:.2f} mm")
