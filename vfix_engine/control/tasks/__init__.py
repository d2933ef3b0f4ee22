"""Tasks: what the tool does, each an immutable object that requests the rows of one step (Li 2007, section IV).

Every guided task requests a velocity that differs from the present one by at most an allowed acceleration, from which
the tool can stop at the end of the task and within sight of anatomy.
Their settings are those of the state's ``ControlContext``.
"""

from .approach_path import ApproachPath
from .damping import DampingTask
from .follow_motion import DesiredMotion, DesiredPose, FollowMotion
from .follow_path import FollowPath, PathPoint
from .inspect_target import ApproachTarget, InspectTarget, view_point
from .move_freely import MoveFreely
from .posture import PostureTask
from .weighted_tasks import WeightedTasks

__all__ = [
    "ApproachPath",
    "ApproachTarget",
    "DampingTask",
    "DesiredMotion",
    "DesiredPose",
    "FollowMotion",
    "FollowPath",
    "InspectTarget",
    "MoveFreely",
    "PathPoint",
    "PostureTask",
    "WeightedTasks",
    "view_point",
]
