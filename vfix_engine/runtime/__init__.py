"""Runtime: what drives a world at its fixed rate, whatever the world is.

``system`` has the protocols that a world implements. The rest of the package knows worlds by these alone.
"""

from .command import Command, Master
from .requests import Bend, Request, Reset, SetSettings, SetTask, Straighten
from .snapshot import Blocker, Snapshot, Timing
from .system import Background, Column, Grip, Settings, System, SystemSpec, Worker

__all__ = [
    "Background",
    "Bend",
    "Blocker",
    "Column",
    "Command",
    "Grip",
    "Master",
    "Request",
    "Reset",
    "SetSettings",
    "SetTask",
    "Settings",
    "Snapshot",
    "Straighten",
    "System",
    "SystemSpec",
    "Timing",
    "Worker",
]
