"""The snake as a world that the runtime drives: spec, system, requests, snapshots, and drives without a clock.

``SnakeSystemSpec`` is the world as plain values and arrays, ``SnakeSystem`` what it builds in the control process.
Computations longer than a tick run as a ``Planner`` in the runtime's worker process.
``SnakeDrive`` and ``drive_lumen`` drive without a clock.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any
from warnings import warn

if TYPE_CHECKING:
    from .offline.drive_lumen import drive_lumen
    from .offline.script import DriveSpec
    from .offline.snake_drive import SnakeDrive
    from .reach import Reach, reach_of
    from .requests import FollowTissue, LookRound
    from .settings import DriveSettings, SnakeSettings
    from .snapshot import SnakeSnapshot
    from .spec import LumenContours, LumenSurface, SnakeSystemSpec
    from .stepping.command import SnakeCommand
    from .stepping.state import SnakeState
    from .system import SnakeSystem

_WHERE = {
    "DriveSettings": "settings", "DriveSpec": "offline.script", "FollowTissue": "requests", "LookRound": "requests",
    "LumenContours": "spec", "LumenSurface": "spec", "SnakeCommand": "stepping.command",
    "SnakeDrive": "offline.snake_drive", "SnakeSettings": "settings", "SnakeSnapshot": "snapshot",
    "SnakeState": "stepping.state", "SnakeSystem": "system", "SnakeSystemSpec": "spec",
    "Reach": "reach", "drive_lumen": "offline.drive_lumen", "reach_of": "reach",
}  # fmt: skip

__all__ = [
    "DriveSettings",
    "DriveSpec",
    "FollowTissue",
    "LookRound",
    "LumenContours",
    "LumenSurface",
    "Reach",
    "SnakeCommand",
    "SnakeDrive",
    "SnakeSettings",
    "SnakeSnapshot",
    "SnakeState",
    "SnakeSystem",
    "SnakeSystemSpec",
    "drive_lumen",
    "reach_of",
]


def __getattr__(name: str) -> Any:
    if name == "Command":
        warn("vfix_engine.worlds.snake.Command is SnakeCommand now", DeprecationWarning, stacklevel=2)
        name = "SnakeCommand"
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f".{_WHERE[name]}", __name__), name)
