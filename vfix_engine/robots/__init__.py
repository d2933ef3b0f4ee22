"""Robots and tools, based on Pinocchio.

``RobotModel`` is a serial robot from a URDF, a configuration or a Pinocchio model. ``PlacedRobot`` has its base in the
patient frame, so that its kinematics and Jacobian are in LPS mm. ``SnakeModel`` is a parametric robot of identical
links behind universal joints.
"""

from .config import urdf_frames
from .joints import Joint, Mount, Visual
from .model import PlacedRobot, RobotModel, TipState, robot_from_urdf
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
