"""Drive: a snake robot goes through a lumen along the open route, led by the picture of its endoscope."""

from app.tabs.drive.commands import COMMANDS
from app.tabs.drive.sections import LumenDriveSections
from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "drive",
    "Drive",
    31,
    __name__,
    "LumenDriveTab",
    COMMANDS,
    LumenDriveSections,
    input="drive",
    has_routes=True,
    kinds=("lumen",),
    needs="case",
    endoscope="first",
)
