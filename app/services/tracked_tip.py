"""The tip of the tracked pointer while it was recorded, in the frame of a registration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from app.services.plan_points import number
from app.services.registration import RegistrationContent
from vfix_engine.errors import InputError

if TYPE_CHECKING:
    from app.link import TrackerClient

LONGEST_S = 300.0  # that the tracked pointer is recorded

Floats = npt.NDArray[np.float64]


def recorded_tips(tracker: TrackerClient | None, content: RegistrationContent, seconds: float) -> Floats:
    """Where the tip of the tracked pointer was in the last seconds (n, 3), mm, in the frame that `content` is to.

    By the pointer's calibration where `content` has one; before a robot, by where the tracker stands beside it.
    Raises InputError where the planner listens to no tracker, the pointer was out of sight, or the tracker's place is
    not known.
    """
    if tracker is None:
        raise InputError("the planner listens to no tracker; start it with `vfix serve --tracker HOST:PORT/NAME`.")
    span = number(seconds, "the time")
    if not 0.0 < span <= LONGEST_S:
        raise InputError(f"the pointer is recorded for up to {LONGEST_S:g} s, not for {span:g} s.")
    if content.to == "base" and content.robot is None:
        raise InputError(
            "this registration is to the robot's base, and where the tracker stands beside it is not known: calibrate "
            "the robot to the tracker first."
        )
    poses = np.array([pose.transform for pose in tracker.recorded(span)])
    tip = np.zeros(3) if content.pointer is None else np.array(content.pointer.tip)
    tips: Floats = poses[:, :3, :3] @ tip + poses[:, :3, 3]
    if content.to == "patient" or content.robot is None:
        return tips
    to_base = np.array(content.robot.transform).reshape(4, 4)
    return np.asarray(tips @ to_base[:3, :3].T + to_base[:3, 3], dtype=np.float64)
