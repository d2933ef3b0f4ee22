"""The poses of the rehearsed tool, on a robot or in a free hand, see `app.drives.poses_route`."""

from app.drives.poses import PoseColumns
from app.drives.poses_route import poses_router

COLUMNS = PoseColumns(
    places=("tip", "grip", "virtual_point", "force", "shaft", "side"),
    numbers=("tip_error_mm", "clearance_mm", "margin_mm", "progress_mm", "length_mm", "target_error_mm"),
)

router = poses_router("rehearse", COLUMNS)
