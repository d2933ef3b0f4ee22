"""The live link to 3D Slicer and other programs by OpenIGTLink: sends the open plan and receives proposals."""

from app.live.board import LiveBoard
from app.live.link import LiveLink

__all__ = ["LiveBoard", "LiveLink"]
