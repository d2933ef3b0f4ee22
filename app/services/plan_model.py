"""A plan as a value: path points, targets, tool, robot placing and settings, all in LPS mm."""

from __future__ import annotations

import math
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from app.services.errors import TooLarge
from app.services.names import check_name, check_stored_label
from vfix_engine.control import ControlSettings
from vfix_engine.control.settings import RETIRED
from vfix_engine.errors import PlanError

SCHEMA = "vfix-plan/1"
NOTICE = "Not for clinical use"
DEFAULT_TOOL = "bent_30"
DEFAULT_ROBOT = "steady_hand"
OWN_ROBOT = ("urdf", "tool_frame")
TOOL_SHAPE = ("bend_deg", "shaft_radius_mm")
MAX_COORDINATE = 1e4  # [mm]
MAX_POINTS = 300  # of path points, and of targets

Position = tuple[float, float, float]


@dataclass(frozen=True)
class PlanPoint:
    """A path point or a target; position in LPS mm."""

    id: str
    label: str
    position: Position


def unplaced_robot(name: str = DEFAULT_ROBOT) -> dict[str, Any]:
    """A robot that has no placing yet and gets one when the plan is driven."""
    return {"name": name, "base": None, "q_start": None}


def without_placing(robot: Mapping[str, Any]) -> dict[str, Any]:
    """The same robot, which gets a placing when the plan is driven."""
    return {**robot, "base": None, "q_start": None}


@dataclass(frozen=True)
class PlanContent:
    """What undo and redo go back and forth over, and what a file of a plan carries.

    tool: name of a shipped tool; tool_shape: its 'bend_deg' and 'shaft_radius_mm' where they are not the shipped ones.
    robot: name, base (16 numbers, row by row, transform_base_to_patient [mm]) or None, and q_start ([mm], [rad]) or
    None; of a URDF of one's own also its SHA-256 as 'urdf' and the link that holds the tool as 'tool_frame'.
    settings: those of the controller that differ from its defaults, by field name.
    """

    points: tuple[PlanPoint, ...] = ()
    targets: tuple[PlanPoint, ...] = ()
    tool: str = DEFAULT_TOOL
    tool_shape: Mapping[str, float] = field(default_factory=dict)
    robot: Mapping[str, Any] = field(default_factory=unplaced_robot)
    settings: Mapping[str, float] = field(default_factory=dict)

    def with_points(self, points: Sequence[PlanPoint]) -> PlanContent:
        """The content with another path; a placing that belonged to the old one is dropped."""
        moved = [p.position for p in points] != [p.position for p in self.points]
        robot = without_placing(self.robot) if moved else self.robot
        return replace(self, points=tuple(points), robot=robot)


@dataclass(frozen=True)
class Plan:
    """A stored plan. `revision` grows with every change; a deleted plan carries the time it was deleted at.

    urdf: the URDF of a robot of one's own, where the plan came out of a file; else the store has it by its hash.
    unreadable: in a list, why the plan's content cannot be read; it has no points there then.
    """

    id: str
    name: str
    case_id: str
    case_hash: str
    points: tuple[PlanPoint, ...]
    targets: tuple[PlanPoint, ...]
    tool: str
    robot: Mapping[str, Any]
    settings: Mapping[str, float]
    created: str
    modified: str
    revision: int = 0
    locked: bool = False
    deleted_at: str | None = None
    tool_shape: Mapping[str, float] = field(default_factory=dict)
    urdf: bytes | None = None
    unreadable: str = ""
    schema: str = SCHEMA
    frame: str = "LPS"
    unit: str = "mm"
    notice: str = NOTICE

    @property
    def content(self) -> PlanContent:
        """The part that edits change."""
        return PlanContent(self.points, self.targets, self.tool, self.tool_shape, self.robot, self.settings)


@dataclass(frozen=True)
class PlanFile:
    """A plan as it comes out of a file: no place in a store yet. case_hash is None where the format carries none.

    urdf: that of a robot of one's own, where the file carries it.
    """

    name: str
    content: PlanContent
    case_hash: str | None = None
    urdf: bytes | None = None


def new_point_id() -> str:
    """An identifier that no other point has."""
    return f"p-{secrets.token_hex(5)}"


def check_position(position: Sequence[Any]) -> Position:
    """Three finite coordinates within reach of a patient (HAZ-05). Raises PlanError."""
    values = tuple(position)
    if len(values) != 3:
        raise PlanError("a position needs three numbers, in LPS mm.")
    checked = tuple(number(value, "a coordinate") for value in values)
    if any(abs(value) >= MAX_COORDINATE for value in checked):
        raise PlanError(f"a coordinate is beyond {MAX_COORDINATE:g} mm; check the unit of the position.")
    return (checked[0], checked[1], checked[2])


def number(value: Any, what: str) -> float:
    """A finite float out of a JSON or array number. Raises PlanError."""
    if isinstance(value, (bool, str, bytes)):
        raise PlanError(f"{what} must be a number.")
    try:
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise PlanError(f"{what} must be a number.") from None
    if not math.isfinite(result):
        raise PlanError(f"{what} is not a finite number.")
    return result


def check_content(content: PlanContent) -> PlanContent:
    """The content of a new state: checked like a stored one, and for the number of its points as well.

    Raises InputError or one of its kinds.
    """
    for points, what in ((content.points, "path points"), (content.targets, "targets")):
        if len(points) > MAX_POINTS:
            raise TooLarge(f"{len(points)} {what} are too many; a plan has {MAX_POINTS} at most. Keep every nth.")
    return check_stored(content)


def check_stored(content: PlanContent) -> PlanContent:
    """The content, validated as a whole, without settings that are retired. Raises InputError or one of its kinds."""
    for point in (*content.points, *content.targets):
        check_stored_label(point.label, "label")
        check_position(point.position)
    ids = [point.id for point in (*content.points, *content.targets)]
    if len(set(ids)) != len(ids):
        raise PlanError("two points have the same identifier.")
    _check_word(content.tool, "tool")
    ControlSettings.from_dict(dict(content.settings))
    settings = {name: value for name, value in content.settings.items() if name not in RETIRED}
    shape = check_tool_shape(content.tool_shape)
    return replace(content, tool_shape=shape, robot=check_robot(content.robot), settings=settings)


def check_tool_shape(shape: Any) -> dict[str, float]:
    """A tool's changed bend and radius, by name. Raises PlanError."""
    if not isinstance(shape, Mapping) or set(shape) - set(TOOL_SHAPE):
        raise PlanError(f"a tool's shape has {' and '.join(TOOL_SHAPE)}.")
    return {name: number(shape[name], f"the tool's {name}") for name in TOOL_SHAPE if name in shape}


def check_robot(robot: Mapping[str, Any]) -> dict[str, Any]:
    """A robot's name and placing; base and q_start come together or not at all. Raises PlanError."""
    if not isinstance(robot, Mapping) or set(robot) - {"name", "base", "q_start", *OWN_ROBOT}:
        raise PlanError("a plan's robot has a name, a base and a q_start; one of a URDF its hash and tool frame.")
    own = _check_own_robot(robot)
    name, base, q_start = robot.get("name", DEFAULT_ROBOT), robot.get("base"), robot.get("q_start")
    _check_word(name, "robot")
    if base is None and q_start is None:
        return unplaced_robot(name) | own
    if not _is_list(base, 16) or not _is_list(q_start):
        raise PlanError("a robot's placing needs a base of 16 numbers together with a q_start.")
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
        raise PlanError("a robot of one's own names its URDF by a SHA-256 of 64 hexadecimal digits.")
    return {"urdf": urdf, "tool_frame": check_name(frame, "tool frame's name")}


def _is_list(value: Any, length: int | None = None) -> bool:
    return isinstance(value, (list, tuple)) and 0 < len(value) <= 64 and length in (None, len(value))


def _check_word(text: Any, what: str) -> None:
    """Names of shipped robots and tools: never a path."""
    check_name(text, f"{what}'s name")
    if not all(c.isalnum() or c in "_-" for c in text):
        raise PlanError(f"the {what}'s name may hold letters, digits, '_' and '-' only.")


def content_to_json(content: PlanContent) -> dict[str, Any]:
    """The content as plain JSON values, each number unrounded."""
    return {
        "points": [_point_to_json(point) for point in content.points],
        "targets": [_point_to_json(point) for point in content.targets],
        "tool": content.tool,
        "tool_shape": dict(content.tool_shape),
        "robot": dict(content.robot),
        "settings": dict(content.settings),
    }


def content_from_json(data: Mapping[str, Any]) -> PlanContent:
    """The inverse of `content_to_json`, checked as `check_stored` does. Raises InputError or one of its kinds."""
    settings = data.get("settings", {})
    if not isinstance(settings, Mapping):
        raise PlanError("a plan's settings must be named numbers.")
    return check_stored(
        PlanContent(
            _points_from_json(data.get("points", []), "points"),
            _points_from_json(data.get("targets", []), "targets"),
            data.get("tool", DEFAULT_TOOL),
            check_tool_shape(data.get("tool_shape", {})),
            check_robot(data.get("robot", unplaced_robot())),
            {str(name): number(value, f"the setting {name!s:.40}") for name, value in settings.items()},
        )
    )


def _point_to_json(point: PlanPoint) -> dict[str, Any]:
    return {"id": point.id, "label": point.label, "position": list(point.position)}


def _points_from_json(data: Any, what: str) -> tuple[PlanPoint, ...]:
    if not isinstance(data, list):
        raise PlanError(f"a plan's {what} must be a list.")
    return tuple(_point_from_json(item, what) for item in data)


def _point_from_json(item: Any, what: str) -> PlanPoint:
    if not isinstance(item, Mapping) or not isinstance(item.get("position"), (list, tuple)):
        raise PlanError(f"each of a plan's {what} needs a label and a position.")
    point_id = item.get("id") or new_point_id()
    if not isinstance(point_id, str) or len(point_id) > 64 or not all(c.isalnum() or c in "_-." for c in point_id):
        raise PlanError("a point's identifier may hold up to 64 letters, digits, '_', '-' and '.'.")
    return PlanPoint(point_id, check_stored_label(item.get("label", ""), "label"), check_position(item["position"]))
