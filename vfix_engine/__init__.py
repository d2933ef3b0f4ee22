"""vfix_engine: virtual fixtures from anatomy, arrays in and arrays out.

One unit system everywhere: mm, rad, s, N.
One patient frame everywhere: DICOM LPS (x to the patient's left, y posterior, z superior).
Rotations are active; vectors are columns; transforms are named ``transform_<from>_to_<to>``.

The engine never imports the application, a web framework or a viewer.
Common names can be imported from here; they are loaded on first access.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .moved import find_old_names

if TYPE_CHECKING:
    from . import errors, virtual_fixtures
    from .control import (
        Certified,
        ControlContext,
        Controller,
        ControlSettings,
        HandCommand,
        Problem,
        Refused,
        Solution,
        StepRequest,
        StepState,
        build_step,
        certify_step,
        solve_step,
        tasks,
    )
    from .errors import ControlError, InputError, StartRefused, VfixError
    from .files.mesh_files import read_mesh
    from .geometry.mesh import TriangleMesh
    from .geometry.path import SplinePath
    from .proximity.proximity import ProximityTree
    from .registration import Registration, find_beads, register_points
    from .robots import RobotModel, Tool
    from .virtual_fixtures import Zone, zones
    from .worlds.rigid.simulation import Simulation
    from .worlds.snake.offline.snake_drive import SnakeDrive

__version__ = "0.1.0"

find_old_names()

# Module of each name.
_WHERE = {
    **dict.fromkeys(
        (
            "Certified", "ControlContext", "ControlSettings", "Controller", "HandCommand", "Problem", "Refused",
            "Solution", "StepRequest", "StepState", "build_step", "certify_step", "solve_step",
        ),
        ".control",
    ),
    **dict.fromkeys(("ControlError", "InputError", "StartRefused", "VfixError"), ".errors"),
    "ProximityTree": ".proximity.proximity",
    **dict.fromkeys(("Registration", "find_beads", "register_points"), ".registration"),
    "RobotModel": ".robots",
    "Simulation": ".worlds.rigid.simulation",
    "SnakeDrive": ".worlds.snake.offline.snake_drive",
    "SplinePath": ".geometry.path",
    "Tool": ".robots",
    "TriangleMesh": ".geometry.mesh",
    "Zone": ".virtual_fixtures",
    "read_mesh": ".files.mesh_files",
}  # fmt: skip
_MODULES = {
    "errors": ".errors",
    "fixtures": ".fixtures",  # its name of version 0.1
    "tasks": ".control.tasks",
    "virtual_fixtures": ".virtual_fixtures",
    "zones": ".virtual_fixtures.zones",
}

__all__ = [
    "Certified",
    "ControlContext",
    "ControlError",
    "ControlSettings",
    "Controller",
    "HandCommand",
    "InputError",
    "Problem",
    "ProximityTree",
    "Refused",
    "Registration",
    "RobotModel",
    "Simulation",
    "SnakeDrive",
    "Solution",
    "SplinePath",
    "StartRefused",
    "StepRequest",
    "StepState",
    "Tool",
    "TriangleMesh",
    "VfixError",
    "Zone",
    "build_step",
    "certify_step",
    "errors",
    "find_beads",
    "read_mesh",
    "register_points",
    "solve_step",
    "tasks",
    "virtual_fixtures",
    "zones",
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name], __name__)
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_WHERE[name], __name__), name)
