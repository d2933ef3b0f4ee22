"""Tube: drives a point in a tube, a world of its own, with the process, lease and recording of every drive."""

from app.drives.commands import COMMANDS, MoveAxes
from app.drives.sections import DriveSections
from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "tube",
    "Tube",
    50,
    __name__,
    "TubeTab",
    (*COMMANDS, MoveAxes),
    DriveSections,
    input="drive",
    kinds=("lumen",),
    needs="case",
)
