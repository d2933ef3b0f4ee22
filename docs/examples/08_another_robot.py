"""Another robot and another tool: from a URDF and a configuration, or from a Pinocchio model.

The same path, driven by a seven-joint arm that holds an endoscope; base and posture are found by dry runs.
"""

import pinocchio
import trimesh

from vfix_engine import RobotModel, Simulation, TriangleMesh

tunnel = trimesh.creation.annulus(r_min=8.0, r_max=11.0, height=60.0).subdivide_to_size(3.0)
simulation = Simulation(
    TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [1, 0, 10]], robot="arm_7", tool="endoscope_30"
)
for _ in range(1000):
    now = simulation.step(drive=1)
camera = simulation.rehearsal.scene.tool.camera
print(f"{len(simulation.q)} joints, {now.progress_mm:.1f} mm along the path, clearance {now.clearance_mm:.2f} mm")
assert camera is not None
assert now.progress_mm > 5.0

model = pinocchio.buildSampleModelManipulator()  # metres; a model of your own comes from its URDF or MJCF
robot = RobotModel.from_pinocchio(model, "effector_body", weights={"wrist2_joint": 20.0})
print(f"{len(robot.joints)} joints from Pinocchio; assumed: {robot.notes[0]}")
assert [joint.name for joint in robot.joints] == list(model.names)[1:]
