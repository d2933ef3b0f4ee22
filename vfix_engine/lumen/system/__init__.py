"""The snake as a system that the runtime drives: what crosses to the control process, steps, requests and snapshots.

``SnakeSystemSpec`` is the world as plain values and arrays, ``SnakeSystem`` what it builds there.
What takes longer than a tick is computed by a ``Planner`` in the runtime's worker process.
"""

from .drive_system import DriveRecorder, DriveSpec
from .requests import FollowTissue, LookRound
from .settings import SnakeSettings
from .snapshot import SnakeSnapshot
from .spec import LumenContours, LumenSurface, SnakeSystemSpec
from .system import SnakeState, SnakeSystem

__all__ = [
    "DriveRecorder",
    "DriveSpec",
    "FollowTissue",
    "LookRound",
    "LumenContours",
    "LumenSurface",
    "SnakeSettings",
    "SnakeSnapshot",
    "SnakeState",
    "SnakeSystem",
    "SnakeSystemSpec",
]
