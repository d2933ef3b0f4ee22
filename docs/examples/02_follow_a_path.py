"""The engine in ten lines: a mesh, a robot, a tool and a task, stepped by a force.

The tool follows the path whatever direction the hand pulls in, as far as bone and joints allow.
"""

import trimesh

from vfix_engine import Simulation, TriangleMesh

tunnel = trimesh.creation.annulus(r_min=6.0, r_max=9.0, height=80.0).subdivide_to_size(3.0)
mesh = TriangleMesh(tunnel.vertices, tunnel.faces)
points = [[0, 0, -20], [1, 0, 0], [0, 1, 20]]  # mm
simulation = Simulation(mesh, path=points, robot="steady_hand", tool="bent_30", margin_mm=0.5)
for _ in range(1000):  # one second at 1 kHz
    now = simulation.step(force=[2.0, 0.0, 3.0])  # N: along the path, and two thirds of that into the wall
print(f"{now.progress_mm:.2f} of {now.length_mm:.1f} mm, {now.tip_error_mm:.4f} mm off the path")
print(f"q = {simulation.q.round(2)}, clearance {simulation.clearance_mm:.2f} mm, active: {simulation.active}")
assert simulation.clearance_mm >= 0.5
assert now.progress_mm > 2.0
