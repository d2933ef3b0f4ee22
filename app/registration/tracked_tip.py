"""The tip of the tracked pointer while it was recorded, in the frame of a registration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from app.kit.values import number
from app.registration.calibrating import NO_TRACKER
from app.registration.calibration import tracked_through
from app.registration.document import RegistrationContent
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError

if TYPE_CHECKING:
    from app.link import TrackerClient

LONGEST_S = 300.0  # that the tracked pointer is recorded


def recorded_tips(tracker: TrackerClient | None, content: RegistrationContent, seconds: float) -> Array:
    """Where the tip of the tracked pointer was in the last seconds (n, 3), mm, in the frame that `content` is to.

    By the pointer's calibration where `content` has one; before a robot, by where the tracker stands beside it.
    Raises InputError where the planner listens to no tracker or the pointer was out of sight, and as `tracked_through`.
    """
    if tracker is None:
        raise InputError(NO_TRACKER)
    span = number(seconds, "the time")
    if not 0.0 < span <= LONGEST_S:
        raise InputError(f"the pointer is recorded for at most {LONGEST_S:g} s, not {span:g} s.")
    tip, matrix = tracked_through(content)
    poses = np.array([pose.transform for pose in tracker.recorded(span, tip)])
    tips = poses[:, :3, :3] @ tip + poses[:, :3, 3]
    return np.asarray(tips @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float64)
