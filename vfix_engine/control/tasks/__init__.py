"""Tasks: what the tool is to do, each an immutable object that asks for the rows of one step (Li 2007, section IV).

Every guided task asks for a velocity that differs from the present one by no more than an acceleration allows, that can
still stop where the task ends, and from which the tool can stop in sight of anatomy.
Their settings are those of the state's ``ControlContext``.
"""

from .approach_path import ApproachPath
from .damping import DampingTask
from .follow_path import FollowPath, PathPoint
from .inspect_target import ApproachTarget, InspectTarget, view_point
from .move_freely import MoveFreely
from .posture import PostureTask
from .weighted_tasks import WeightedTasks

__all__ = [
    "ApproachPath",
    "ApproachTarget",
    "DampingTask",
    "FollowPath",
    "InspectTarget",
    "MoveFreely",
    "PathPoint",
    "PostureTask",
    "WeightedTasks",
    "view_point",
]
