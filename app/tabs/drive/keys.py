"""What a key of the page is to a snake: full speed of insertion, and a slow speed of the camera."""

from __future__ import annotations

from app.drives.commands import Push
from app.drives.summed_axes import Axes
from app.tabs.drive.commands import TiltCamera

KEY_CAMERA_MM_PER_S = 8.5  # across its picture: the view turns by about 23° in a second, by 1.6° with a tap of 0.1 s


def key_axes(command: Push | TiltCamera, camera_mm_per_s: float) -> Axes:
    """Axes of a key: insertion, or the camera to a side, up or down.

    camera_mm_per_s: of a full axis. That is a speed for a hand that says how far; a key only says for how long.
    """
    share = min(1.0, KEY_CAMERA_MM_PER_S / camera_mm_per_s) * command.direction
    match command.type:
        case "drive":
            return 0.0, 0.0, float(command.direction)
        case "twist":
            return share, 0.0, 0.0
        case "tilt":
            return 0.0, -share, 0.0
