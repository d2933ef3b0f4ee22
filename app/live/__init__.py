"""The live link to 3D Slicer and others by OpenIGTLink: the open plan out, proposals in."""

from app.live.board import LiveBoard
from app.live.link import LiveLink

__all__ = ["LiveBoard", "LiveLink"]
