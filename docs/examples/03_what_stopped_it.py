"""Which constraint stopped the tool?

In free motion the tool yields to the hand in every direction until bone holds it, and says what does.
"""

import numpy as np
import trimesh

from vfix_engine import Simulation, TriangleMesh

tunnel = trimesh.creation.annulus(r_min=6.0, r_max=9.0, height=80.0).subdivide_to_size(3.0)
simulation = Simulation(TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [0, 0, 20]])
simulation.task("free")
clearance = [simulation.step(force=[5.0, 0.0, 0.0]).clearance_mm for _ in range(2000)]  # N, into the wall
print(f"active: {', '.join(simulation.active)}")
print(f"least clearance {min(clearance):.4f} mm, margin {simulation.now.margin_mm} mm")
assert min(clearance) >= simulation.now.margin_mm
assert any(text.startswith("bone on the") for text in simulation.active)
assert np.ptp(clearance) > 1.0
