"""Teleoperation: a remote master leads, the tool follows along the path, and the master feels the constraints."""

import numpy as np
import trimesh

from vfix_engine import Simulation, TriangleMesh

tunnel = trimesh.creation.annulus(r_min=6.0, r_max=9.0, height=80.0).subdivide_to_size(3.0)
simulation = Simulation(TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [0, 0, 20]])
for _ in range(1000):
    now = simulation.step(master=[0.004, 0.0, 0.008])  # mm in this millisecond: forwards and aside
print(f"{now.progress_mm:.2f} mm along the path, {now.tip_error_mm:.4f} mm off it")
print(f"the master feels {np.linalg.norm(now.reflection):.2f} N")
assert now.progress_mm > 1.0
assert now.tip_error_mm < 0.01
assert np.linalg.norm(now.reflection) > 0.1
