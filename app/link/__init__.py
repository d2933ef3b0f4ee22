"""OpenIGTLink: messages, a server for several clients, and a client of a tracking server.

This package is independent of plans and cases, which `app.live` handles.
"""

from app.link.messages import LinkFault, LinkMessage, ListPoint, PointList, Text, Transform
from app.link.server import LinkServer
from app.link.tracker import Collected, TrackedPose, TrackerClient

__all__ = [
    "Collected",
    "LinkFault",
    "LinkMessage",
    "LinkServer",
    "ListPoint",
    "PointList",
    "Text",
    "TrackedPose",
    "TrackerClient",
    "Transform",
]
