"""The live link to 3D Slicer and others by OpenIGTLink: the open plan out, proposals in."""

from app.services.live_link.board import LiveBoard
from app.services.live_link.link import LiveLink

__all__ = ["LiveBoard", "LiveLink"]
