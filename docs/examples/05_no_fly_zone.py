"""Keep out of a structure: a no-fly zone with a margin of its own.

A zone is as hard as bone: shapes and patches of surface join the anatomy, and the certificate judges them alike.
"""

import numpy as np
import trimesh

from vfix_engine import Simulation, TriangleMesh
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.virtual_fixtures import Zone

tunnel = trimesh.creation.annulus(r_min=12.0, r_max=15.0, height=80.0).subdivide_to_size(4.0)
nerve = Zone("optic nerve", Sphere(centre=[6.0, 0.0, -10.0], radius=2.0), margin_mm=1.0)
simulation = Simulation(
    TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [0, 0, 20]], tool="straight_pointer", zones=[nerve]
)
simulation.task("free")
for _ in range(3000):
    towards = nerve.solid.centre - simulation.now.tip
    now = simulation.step(force=5.0 * towards / np.linalg.norm(towards))
print(f"active: {', '.join(simulation.active)}")
assert np.linalg.norm(towards) - 2.0 - now.radius[0] >= 1.0
assert any("optic nerve" in text for text in simulation.active)
