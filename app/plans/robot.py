"""The robot of a plan: its name, or a URDF of one's own, and its placement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.kit.names import check_stored_name
from app.kit.values import number
from app.plans.paths import check_word
from vfix_engine.errors import PlanError

DEFAULT_ROBOT = "steady_hand"
OWN_ROBOT = ("urdf", "tool_frame")


def unplaced_robot(name: str = DEFAULT_ROBOT) -> dict[str, Any]:
    """A robot that has no placement yet and gets one when the plan is driven."""
    return {"name": name, "base": None, "q_start": None}


def without_placement(robot: Mapping[str, Any]) -> dict[str, Any]:
    """The same robot, which gets a placement when the plan is driven."""
    return {**robot, "base": None, "q_start": None}


def check_robot(robot: Mapping[str, Any]) -> dict[str, Any]:
    """A robot's name and placement; base and q_start come together or not at all. Raises PlanError."""
    if not isinstance(robot, Mapping) or set(robot) - {"name", "base", "q_start", *OWN_ROBOT}:
        raise PlanError("a plan's robot has a name, a base and a q_start; one of a URDF its hash and tool frame.")
    own = _check_own_robot(robot)
    name, base, q_start = robot.get("name", DEFAULT_ROBOT), robot.get("base"), robot.get("q_start")
    check_word(name, "robot")
    if base is None and q_start is None:
        return unplaced_robot(name) | own
    if not _is_list(base, 16) or not _is_list(q_start):
        raise PlanError("a robot's placing needs a base of 16 numbers and a q_start.")
    assert base is not None
    assert q_start is not None
    return {
        "name": name,
        "base": [number(value, "the robot's base") for value in base],
        "q_start": [number(value, "the robot's start") for value in q_start],
    } | own


def _check_own_robot(robot: Mapping[str, Any]) -> dict[str, str]:
    """Hash and tool frame of a URDF of one's own; empty for a shipped robot."""
    urdf, frame = (robot.get(key) for key in OWN_ROBOT)
    if urdf is None and frame is None:
        return {}
    if not isinstance(urdf, str) or len(urdf) != 64 or set(urdf) - set("0123456789abcdef"):
        raise PlanError("a robot names its URDF by a SHA-256 of 64 hexadecimal digits.")
    if frame is None:
        raise PlanError("a robot needs a tool_frame, the link that holds the tool.")
    return {"urdf": urdf, "tool_frame": check_stored_name(frame, "tool frame's name")}


def _is_list(value: Any, length: int | None = None) -> bool:
    return isinstance(value, (list, tuple)) and 0 < len(value) <= 64 and length in (None, len(value))
