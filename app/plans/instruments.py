"""Robots and tools that a plan can name: those that come along, and robots of URDFs that were uploaded."""

from __future__ import annotations

import io
import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from app.kit.names import check_name
from app.plans.paths import check_word
from vfix_engine.errors import PlanError
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool, robot_from_urdf, urdf_frames
from vfix_engine.robots.tool import MOST_BEND, SHAFT_RADIUS_MM

if TYPE_CHECKING:
    from app.store.files import FileStore

MAX_BEND_DEG = math.degrees(MOST_BEND)
MAX_URDF_BYTES = 1 << 20


class UsesInstruments(Protocol):
    """What a plan says of its robot and tool."""

    @property
    def tool(self) -> str: ...

    @property
    def tool_shape(self) -> Mapping[str, float]: ...

    @property
    def robot(self) -> Mapping[str, Any]: ...


class RobotSource(Protocol):
    """Where robots of one's own are found."""

    def robot(self, robot: Mapping[str, Any]) -> RobotModel: ...


@dataclass(frozen=True)
class CarriedUrdf:
    """The URDF of a plan's robot that came in the plan's file."""

    urdf: bytes

    def robot(self, robot: Mapping[str, Any]) -> RobotModel:
        """The robot that a plan names. Raises RobotError."""
        return robot_from_urdf(self.urdf, robot["name"], robot["tool_frame"])


@dataclass(frozen=True)
class OwnRobot:
    """A URDF that was read. links: that may hold a tool; ends: those without a child; notes: what was assumed."""

    name: str
    urdf: str
    links: tuple[str, ...]
    ends: tuple[str, ...]
    tool_frame: str
    notes: tuple[str, ...]


def plan_tool(plan: UsesInstruments) -> Tool:
    """The tool of a plan, in its shape. Raises RobotError."""
    return shaped_tool(plan.tool, **plan.tool_shape)


def plan_robot(plan: UsesInstruments, instruments: RobotSource | None) -> RobotModel:
    """The robot of a plan. instruments: where URDFs are; None where there are none. Raises RobotError, PlanError."""
    robot = plan.robot
    if robot.get("urdf") is None:
        return RobotModel.load(robot["name"])
    if instruments is None:
        raise PlanError("the plan's robot is a URDF that its file does not carry; export the plan again.")
    return instruments.robot(robot)


@lru_cache(maxsize=32)
def shaped_tool(name: str, bend_deg: float | None = None, shaft_radius_mm: float | None = None) -> Tool:
    """A shipped tool by its name, which is no path, with another bend and radius. Raises RobotError, PlanError."""
    check_word(name, "tool")
    return Tool.load(name).shaped(None if bend_deg is None else math.radians(bend_deg), shaft_radius_mm)


@cache
def shipped_robots() -> tuple[RobotModel, ...]:
    """Robots that come along, by title."""
    return tuple(sorted((RobotModel.load(name) for name in _names("robots")), key=lambda robot: robot.title))


@cache
def shipped_tools() -> tuple[Tool, ...]:
    """Tools that come along, by title."""
    return tuple(sorted((Tool.load(name) for name in _names("tools")), key=lambda tool: tool.title))


def robot_words(robot: RobotModel) -> str:
    """What a robot is: its joints, how its base is placed, and what was assumed."""
    slide = int((~robot.revolute).sum())
    kinds = f"{len(robot.joints)} joints, {slide} of them sliding" if slide else f"{len(robot.joints)} turning joints"
    base = "its base stands upright" if robot.upright else "its base is held as the path asks"
    return f"{kinds}; {base}."


def tool_words(tool: Tool) -> str:
    """What a tool is: its bend, its shaft, and the tilt of its view."""
    words = [f"bent by {math.degrees(tool.bend):.0f}°" if tool.bend else "straight"]
    words.append(f"shaft of radius {tool.shaft_radius:.1f} mm, {sum(part.length for part in tool.parts):.0f} mm long")
    if tool.camera is not None:
        tilt = math.degrees(math.acos(min(1.0, float(tool.camera.view[1]))))
        words.append(f"looks {tilt:.0f}° to its side" if tilt > 0.5 else "looks straight ahead")
    return f"{', '.join(words)[:1].upper()}{', '.join(words)[1:]}."


class Instruments:
    """Robots and tools by what a plan says of them; may be used from any thread."""

    def __init__(self, files: FileStore) -> None:
        self._files = files

    def robot(self, robot: Mapping[str, Any]) -> RobotModel:
        """The robot that a plan names. Raises RobotError, and StorageError where its URDF is not in the store."""
        if robot.get("urdf") is None:
            return RobotModel.load(robot["name"])
        return robot_from_urdf(self.urdf(robot["urdf"]), robot["name"], robot["tool_frame"])

    def urdf(self, key: str) -> bytes:
        """A stored URDF by its SHA-256. Raises PlanError where it is not there."""
        if not self._files.has(key):
            raise PlanError("the URDF of this plan's robot is not stored here; upload it again or choose another.")
        return self._files.path(key).read_bytes()

    def carried(self, plan: UsesInstruments, form: str) -> bytes | None:
        """What an export of a plan in this format carries of a robot of one's own. Raises PlanError."""
        key = plan.robot.get("urdf")
        return None if key is None or form != "json" else self.urdf(key)

    def frames(self, key: str) -> tuple[str, ...]:
        """Links of a stored URDF that may hold the tool. Raises PlanError and RobotError."""
        return urdf_frames(self.urdf(key))[0]

    def add_urdf(self, file_name: str, data: bytes, tool_frame: str | None = None) -> OwnRobot:
        """Store a URDF once the engine's reader takes it.

        tool_frame: the link that holds the tool; where nobody says, the first one without a child.
        Raises RobotError with what is wrong with the file.
        """
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            raise PlanError("the URDF is not UTF-8 text; save it as UTF-8.") from None
        links, ends = urdf_frames(data)
        frame = tool_frame or ends[0]
        name = urdf_name(file_name)
        robot = robot_from_urdf(data, name, frame)
        key = self._files.put_with(lambda target: shutil.copyfileobj(io.BytesIO(data), target))
        return OwnRobot(name, key, links, ends, check_name(frame, "tool frame's name"), robot.notes)


def urdf_name(file_name: str) -> str:
    """A robot's name out of a file's, of the characters that a plan's robot may have."""
    stem = Path(file_name.replace("\\", "/")).name.removesuffix(".urdf")
    kept = "".join(c if (c.isascii() and c.isalnum()) or c in "_-" else "_" for c in stem)[:60].strip("_")
    return kept or "robot"


def _names(folder: str) -> list[str]:
    return [path.stem for path in (assets_dir() / folder).glob("*.json")]


__all__ = [
    "MAX_BEND_DEG",
    "MAX_URDF_BYTES",
    "SHAFT_RADIUS_MM",
    "CarriedUrdf",
    "Instruments",
    "OwnRobot",
    "RobotSource",
    "plan_robot",
    "plan_tool",
    "robot_words",
    "shaped_tool",
    "shipped_robots",
    "shipped_tools",
    "tool_words",
    "urdf_name",
]
