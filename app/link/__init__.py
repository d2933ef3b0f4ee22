"""OpenIGTLink: messages, a server that several clients listen to, and a client of a tracking server.

Nothing here knows plans or cases; `app.live` does.
"""

from app.link.messages import LinkFault, LinkMessage, ListPoint, PointList, Text, Transform
from app.link.server import LinkServer
from app.link.tracker import Collected, Pose, TrackerClient

__all__ = [
    "Collected",
    "LinkFault",
    "LinkMessage",
    "LinkServer",
    "ListPoint",
    "PointList",
    "Pose",
    "Text",
    "TrackerClient",
    "Transform",
]
