"""From the surface of a lumen and two clicks to a snake that has been driven through it.

The surface here is a ring of 28 mm inner width; a colon's is read with ``read_mesh``.
"""

import numpy as np
import trimesh

from vfix_engine import SnakeDrive, TriangleMesh
from vfix_engine.worlds.snake.offline.drive_lumen import DriveSettings, SnakeCommand, drive_lumen

ring = trimesh.creation.torus(major_radius=120.0, minor_radius=14.0, major_sections=96, minor_sections=24)
mesh = TriangleMesh(ring.vertices, ring.faces)
start, end = (120.0 * np.array([np.cos(angle), np.sin(angle), 0.0]) for angle in (0.0, 1.6))
settings = DriveSettings(contours=16, interpolated=61, vertices_per_link=50, bends=4, step_s=0.01)
drive = SnakeDrive.in_lumen(mesh, start, end, links=7, settings=settings)  # for a hand of your own
for _ in range(100):
    drive.step(SnakeCommand(insert_mm_per_s=20.0))
print(f"after a second by hand the tip is {drive.tip_s:.1f} mm in")
report = drive_lumen(mesh, start, end, links=7, landmarks={"polyp": 1.07 * end}, settings=settings)
told = report.to_dict()
print(f"{told['links']} links are {told['inserted_mm']:.0f} mm in")
print(f"outside the pathway by {told['deviation_mm']['max']:.2f} mm at most; bounds are {told['bound_mm']} mm at most")
print(report.behind_wall["words"])
print(f"at the landmark the view went round by {told['landmarks'][0]['turn_deg']:.0f} degrees")
assert 19.0 < drive.tip_s < 21.0
assert report.within_bounds
assert told["inserted_mm"] > 150.0
assert told["landmarks"][0]["looked"]
