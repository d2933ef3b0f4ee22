"""Combine fixtures: a remote centre of motion at the nostril and a cone for the shaft.

Standing fixtures join every task; their rows share one quadratic program with the path, bone and joints.
"""

import numpy as np
import trimesh

from vfix_engine import Simulation, TriangleMesh
from vfix_engine.virtual_fixtures import OrientationCone, RemoteCentre, weighted

tunnel = trimesh.creation.annulus(r_min=12.0, r_max=15.0, height=80.0).subdivide_to_size(4.0)
nostril = np.array([0.0, 0.0, -40.0])
fixtures = [
    weighted(RemoteCentre(nostril, tolerance_mm=1.0), 2.0),
    OrientationCone.of_shaft(axis=[0.0, 0.0, 1.0], angle_rad=np.radians(10.0)),
]
simulation = Simulation(
    TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [0, 0, 0], [2, 1, 20]], tool="straight_pointer",
    fixtures=fixtures,
)  # fmt: skip
worst = 0.0
while simulation.now.phase != "done" and not simulation.now.held:
    now = simulation.step(drive=1)
    shaft = now.segments_end[-1] - now.segments_start[-1]
    shaft /= np.linalg.norm(shaft)
    off = nostril - now.tip
    worst = max(worst, float(np.linalg.norm(off - shaft * (shaft @ off))))
print(f"{now.progress_mm:.1f} of {now.length_mm:.1f} mm; the shaft passed the nostril within {worst:.3f} mm")
assert now.phase == "done"
assert worst <= 1.0
