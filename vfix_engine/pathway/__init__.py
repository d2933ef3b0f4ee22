"""The constraint pathway: closed contours along a lumen that bound the robot's position (Kwok 2013, section III)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .pathway import Pathway

_WHERE = {
    "Pathway": ".pathway",
}

__all__ = ["Pathway"]


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_WHERE[name], __name__), name)
