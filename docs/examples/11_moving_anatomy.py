"""Moving anatomy: the surface is indexed again, and the tool continues from its state.

Where the anatomy has come too near, only motions that bring no part of the tool deeper are taken.
"""

import numpy as np
import trimesh

from vfix_engine import Simulation, TriangleMesh

tunnel = trimesh.creation.annulus(r_min=8.0, r_max=11.0, height=80.0).subdivide_to_size(3.0)
simulation = Simulation(TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [0, 0, 20]])
least = np.inf
for beat in range(20):
    sway = [0.5 * np.sin(beat), 0.0, 0.0]  # mm
    simulation.move_anatomy(TriangleMesh(tunnel.vertices + sway, tunnel.faces))
    for _ in range(50):
        least = min(least, simulation.step(drive=1).clearance_mm)
print(f"{simulation.now.progress_mm:.1f} mm along the path, least clearance {least:.2f} mm")
assert simulation.now.progress_mm > 5.0
assert least >= simulation.now.margin_mm
