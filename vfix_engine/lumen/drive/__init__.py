"""The drive of a snake through a lumen: its state, steps, operators, look-round and report."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .drive import Command, DriveSettings, SnakeDrive, drive_lumen

_WHERE = {
    "Command": ".drive",
    "DriveSettings": ".drive",
    "SnakeDrive": ".drive",
    "drive_lumen": ".drive",
}

__all__ = ["Command", "DriveSettings", "SnakeDrive", "drive_lumen"]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_WHERE[name], __name__), name)
