"""Runtime: runs any world at a fixed rate.

``system`` has the protocols that a world implements; the rest of the package depends only on them.
Modules for driving and recording are loaded on first access; ``replay.replay`` runs a recording again.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .command import Command, Master
from .control_mode import Control
from .operator import Act, Operator
from .requests import Bend, Note, Request, Reset, SetControl, SetSettings, SetTask, Straighten
from .settings import WorldSettings
from .snapshot import Blocker, Snapshot, Timing
from .system import Background, Column, Grip, System, SystemSpec, Worker

if TYPE_CHECKING:
    from .background import InlineWorker
    from .driver import Driver, Log
    from .process import ControlProcess
    from .replay import Replay
    from .ring import RowReader
    from .run import Run, RunEvent, RunWriter

_WHERE = {
    "InlineWorker": "background", "Driver": "driver", "Log": "driver", "ControlProcess": "process",
    "Replay": "replay", "RowReader": "ring", "Run": "run", "RunEvent": "run", "RunWriter": "run",
}  # fmt: skip

__all__ = [
    "Act",
    "Background",
    "Bend",
    "Blocker",
    "Column",
    "Command",
    "Control",
    "ControlProcess",
    "Driver",
    "Grip",
    "InlineWorker",
    "Log",
    "Master",
    "Note",
    "Operator",
    "Replay",
    "Request",
    "Reset",
    "RowReader",
    "Run",
    "RunEvent",
    "RunWriter",
    "SetControl",
    "SetSettings",
    "SetTask",
    "Snapshot",
    "Straighten",
    "System",
    "SystemSpec",
    "Timing",
    "Worker",
    "WorldSettings",
]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(f".{_WHERE[name]}", __name__), name)
