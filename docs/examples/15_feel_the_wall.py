"""Feel the wall of a lumen: the guidance force that leads the hand back, and the resistance to fast motion."""

import numpy as np

from vfix_engine.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.worlds.snake.offline.drive_lumen import DriveSettings, SnakeCommand, SnakeDrive

centre = np.column_stack([np.zeros(31), np.zeros(31), np.linspace(0.0, 300.0, 31)])
pathway = Pathway(centre, np.full(31, 12.0), count=31)
drive = SnakeDrive(SnakeModel(6), pathway, DriveSettings(bends=4, vertices_per_link=50), tip_s=200.0)
for step in range(150):
    now = drive.step(SnakeCommand(camera_mm_per_s=(40.0, 0.0)), dt=0.01)
    if step % 30 == 29:
        guidance, resistance = now.forces.guidance, now.forces.resistance
        print(f"{now.deviation.depth.max():.2f} mm outside: led by {guidance} N, held back by {resistance} N")
assert now.deviation.depth.max() > 0.5
assert now.forces.guidance[0] < 0.0  # to the left: back
assert np.linalg.norm(now.forces.total) <= drive.hand.settings.most
