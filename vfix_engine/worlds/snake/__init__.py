"""The snake as a world that the runtime drives: spec, system, requests, snapshots, and drives without a clock.

``SnakeSystemSpec`` is the world as plain values and arrays, ``SnakeSystem`` what it builds in the control process.
What takes longer than a tick is computed by a ``Planner`` in the runtime's worker process.
``SnakeDrive`` and ``drive_lumen`` drive without a clock.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .drive import Command, DriveSettings, SnakeDrive, drive_lumen
    from .drive_system import DriveRecorder, DriveSpec
    from .requests import FollowTissue, LookRound
    from .settings import SnakeSettings
    from .snapshot import SnakeSnapshot
    from .spec import LumenContours, LumenSurface, SnakeSystemSpec
    from .system import SnakeState, SnakeSystem

_WHERE = {
    "Command": "drive", "DriveSettings": "drive", "SnakeDrive": "drive", "drive_lumen": "drive",
    "DriveRecorder": "drive_system", "DriveSpec": "drive_system", "FollowTissue": "requests", "LookRound": "requests",
    "SnakeSettings": "settings", "SnakeSnapshot": "snapshot", "LumenContours": "spec", "LumenSurface": "spec",
    "SnakeSystemSpec": "spec", "SnakeState": "system", "SnakeSystem": "system",
}  # fmt: skip

__all__ = [
    "Command",
    "DriveRecorder",
    "DriveSettings",
    "DriveSpec",
    "FollowTissue",
    "LookRound",
    "LumenContours",
    "LumenSurface",
    "SnakeDrive",
    "SnakeSettings",
    "SnakeSnapshot",
    "SnakeState",
    "SnakeSystem",
    "SnakeSystemSpec",
    "drive_lumen",
]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f".{_WHERE[name]}", __name__), name)
