"""Soft tissue yields, bone does not: a compliant layer over a hard wall.

Under a steady hand the tool sinks into the tissue until its spring carries the force: δ = f / k.
"""

import trimesh

from vfix_engine import Simulation, TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.virtual_fixtures import SoftZone

wall = trimesh.creation.box(extents=[60.0, 60.0, 4.0]).subdivide_to_size(5.0)  # from z = -2 to 2 mm
tree = ProximityTree(TriangleMesh(wall.vertices, wall.faces))
mucosa = SoftZone("mucosa", thickness_mm=6.0, stiffness_n_per_mm=1.5)
simulation = Simulation(tree, path=[[0, 0, -15], [0, 0, -2]], tool="straight_pointer", fixtures=[mucosa])
for _ in range(3000):
    now = simulation.step(force=[0.0, 0.0, 3.0])  # N, straight at the wall
depth = mucosa.penetration(simulation.state.tool, tree)
print(f"{depth:.2f} mm deep in the mucosa; f / k = {3.0 / 1.5:.2f} mm")
assert abs(depth - 2.0) < 0.1
