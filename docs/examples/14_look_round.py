"""Look around in a lumen: camera commands, with every link within its bound of the pathway."""

import numpy as np

from vfix_engine.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.offline.drive_lumen import DriveSettings, SnakeCommand, SnakeDrive

angle = np.linspace(0.0, 1.8, 25)
centre = 130.0 * np.column_stack([1.0 - np.cos(angle), np.zeros(25), np.sin(angle)])
pathway = Pathway(centre, np.full(25, 14.0), count=73)  # circles of 14 mm along a bend
drive = SnakeDrive(SnakeModel(6), pathway, DriveSettings(bound_mm=5.0, bends=4, vertices_per_link=50), tip_s=200.0)
before = drive.snake.camera(drive.q, drive.state.base)
for _ in range(200):
    now = drive.step(SnakeCommand(camera_mm_per_s=(80.0, 0.0)), dt=0.01)  # to the right in the picture
after = drive.snake.camera(drive.q, drive.state.base)
turned = np.degrees(np.arccos(before[:3, 2] @ after[:3, 2]))
print(f"the view has turned by {turned:.0f} degrees; r = {np.hypot(*now.steering):.2f}")
print(f"links outside the pathway: {np.round(now.deviation.depth, 2)} mm; what holds them: {now.held_by}")
assert turned > 20.0
assert (now.deviation.depth <= drive.bound).all()
