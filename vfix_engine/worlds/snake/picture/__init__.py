"""Pictures of the lumen, the pathway and the robot, and the view of its camera."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .picture import LumenPictures

_WHERE = {
    "LumenPictures": ".picture",
}

__all__ = ["LumenPictures"]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_WHERE[name], __name__), name)
