"""Robots and tools over Pinocchio.

A robot file names its joints in order, each with axis, range, speed and the source of those numbers.
A placed robot has its base somewhere in the patient frame: its kinematics and Jacobian are in LPS mm.
A snake of universal joints has no file: it is made from the number of its links.
"""

from .config import robot_from_urdf, urdf_frames
from .model import Joint, Mount, RobotModel, Visual
from .placed import PlacedRobot, TipState
from .snake import SnakeModel
from .snake_surface import LinkVertices
from .tool import Camera, Part, Tool

__all__ = [
    "Camera",
    "Joint",
    "LinkVertices",
    "Mount",
    "Part",
    "PlacedRobot",
    "RobotModel",
    "SnakeModel",
    "TipState",
    "Tool",
    "Visual",
    "robot_from_urdf",
    "urdf_frames",
]
