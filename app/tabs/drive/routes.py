"""The poses of the snake robot's camera, see `app.drives.poses_route`."""

from app.drives.poses import PoseColumns
from app.drives.poses_route import poses_router

COLUMNS = PoseColumns(
    places=("tip", "eye", "shaft", "side", "forces", "guidance_force"),
    numbers=("progress_mm", "length_mm", "bend"),
)

router = poses_router("drive", COLUMNS)
