"""vfix_engine: virtual fixtures from anatomy, arrays in and arrays out.

One unit system everywhere: mm, rad, s, N.
One patient frame everywhere: DICOM LPS (x to the patient's left, y posterior, z superior).
Rotations are active; vectors are columns; transforms are named ``transform_<from>_to_<to>``.

The engine never imports the application, a web framework or a viewer.
What a script needs most can be imported from here; it is loaded when it is first asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .control import ControlSettings
    from .geometry.mesh import TriangleMesh
    from .geometry.path import SplinePath
    from .imaging.mesh_files import read_mesh
    from .lumen.drive.snake_drive import SnakeDrive
    from .robots import RobotModel, Tool
    from .simulation.simulation import Simulation

__version__ = "0.1.0"

_WHERE = {
    "ControlSettings": ".control",
    "RobotModel": ".robots",
    "Simulation": ".simulation.simulation",
    "SnakeDrive": ".lumen.drive.snake_drive",
    "SplinePath": ".geometry.path",
    "Tool": ".robots",
    "TriangleMesh": ".geometry.mesh",
    "read_mesh": ".imaging.mesh_files",
}

__all__ = [
    "ControlSettings",
    "RobotModel",
    "Simulation",
    "SnakeDrive",
    "SplinePath",
    "Tool",
    "TriangleMesh",
    "read_mesh",
]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_WHERE[name], __name__), name)
