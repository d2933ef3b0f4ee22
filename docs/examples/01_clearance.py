"""How far is a tool from the anatomy?

Every distance in the engine is exact: from the surface of the tool's capsules to the triangles of the mesh.
"""

import numpy as np

from vfix_engine import Tool, read_mesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.resources import assets_dir

mesh, frame = read_mesh(assets_dir() / "head_phantom" / "bone_nose.ply")  # vertices (V, 3) in LPS, mm
tree = ProximityTree(mesh)
tool = Tool.load("bent_30")
pose = tool.segments(rotation=np.eye(3), position=np.array([5.0, 8.0, 7.0]))  # the shaft along +y (posterior)

pair = tree.closest(pose)
print(f"{len(mesh.faces)} triangles in {frame.name}; the {tool.segment_names[pair.segment]} is nearest")
print(f"clearance {tree.clearance(pose):.3f} mm, to bone at {np.round(pair.on_surface, 1)}")
print(f"{len(tree.pairs_within(pose, 3.0))} triangles within 3 mm of the tool")
assert pair.distance == tree.clearance(pose)
