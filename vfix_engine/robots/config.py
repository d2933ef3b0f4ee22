"""Reader of robot configurations (``vfix-robot/2``): URDF, base and tool frame, and values missing in the URDF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import RobotError
from .description import check_keys, description_path, read_bytes, read_description, transform_of
from .joints import Mount, RobotParts
from .local_path import local_path
from .serial import JointConfig, serial_robot
from .urdf import Urdf, parse_urdf

ROBOT_SCHEMA = "vfix-robot/2"
UNITS = {"length": "mm", "angle": "rad"}
Z_ALONG_SHAFT = (0.5 * np.pi, 0.0, 0.0)  # rotates the flange's y axis, along the shaft, to z of the tool frame

_NOWHERE = Path("a URDF without a folder")
_KEYS = {
    "schema", "name", "title", "source", "units", "urdf", "base_frame", "tool_frame", "tool_mount", "stands", "home",
    "joints",
}  # fmt: skip
_JOINT_KEYS = {"title", "lower", "upper", "speed", "acceleration", "weight", "source"}
_NUMBERS = ("lower", "upper", "speed", "acceleration")  # of a joint; these need a stated source


@dataclass(frozen=True)
class RobotConfig:
    """A configuration; lengths in mm, angles in rad. None selects the value of the URDF."""

    name: str
    title: str
    source: str
    urdf: str = ""
    base_frame: str | None = None
    tool_frame: str | None = None
    mount_xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mount_rpy: tuple[float, float, float] = Z_ALONG_SHAFT
    hold: str = "tail"
    upright: bool = False  # the key 'stands'
    home: Mapping[str, float] = field(default_factory=dict)
    joints: Mapping[str, JointConfig] = field(default_factory=dict)
    complete: bool = True  # False for a plain URDF, whose missing values are assumed

    def mount(self) -> Mount:
        """The frame that holds the tool, relative to the tool frame."""
        return Mount(transform_of(self.mount_xyz, self.mount_rpy), self.hold)


def load_robot(name_or_path: str | Path, tool_frame: str | None = None) -> RobotParts:
    """See ``RobotModel.load``."""
    path = description_path(name_or_path, "robots")
    if path.suffix.lower() == ".urdf":
        return _built(path, RobotConfig(path.stem, path.stem, "the URDF alone", tool_frame=tool_frame, complete=False))
    if path.suffix.lower() != ".json":
        raise RobotError(f"{path.name}: a robot is a shipped name, a configuration (.json) or a URDF (.urdf)")
    data = read_description(name_or_path, "robots", ROBOT_SCHEMA)
    try:
        config = _config(data)
        file = local_path(path.parent, config.urdf)
    except RobotError as error:
        raise RobotError(f"{path.name}: {error}") from error
    if tool_frame is not None and tool_frame != config.tool_frame:
        # Mount and hold belong to the configuration's own tool frame.
        config = replace(config, tool_frame=tool_frame, mount_xyz=(0.0, 0.0, 0.0), mount_rpy=Z_ALONG_SHAFT, hold="tail")
    return _built(file, config)


def parts_of_urdf(data: bytes, name: str, tool_frame: str | None = None) -> RobotParts:
    """See ``robot_from_urdf``."""
    config = RobotConfig(name, name, "the URDF alone", tool_frame=tool_frame, complete=False)
    return _robot(parse_urdf(data, _NOWHERE), config)


def urdf_frames(data: bytes) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of all links of a URDF except its root, and of the leaf links. Raises RobotError."""
    urdf = parse_urdf(data, _NOWHERE)
    return tuple(link for link in urdf.links if link != urdf.root), urdf.leaves()


def _built(file: Path, config: RobotConfig) -> RobotParts:
    data = read_bytes(file, "robots")
    try:
        return _robot(parse_urdf(data, file.parent), config)
    except RobotError as error:
        # Only the file name: the rest of the path may contain a person's name.
        raise RobotError(f"{file.name}: {error}") from error


def _robot(urdf: Urdf, config: RobotConfig) -> RobotParts:
    unknown = sorted((set(config.joints) | set(config.home)) - {joint.name for joint in urdf.joints})
    if unknown:
        raise RobotError(f"the configuration names the joint '{unknown[0]}', which the URDF does not have")
    base = urdf.root if config.base_frame is None else config.base_frame
    tool = config.tool_frame
    if tool is None:
        leaves = urdf.leaves()
        if len(leaves) > 1:
            raise RobotError(f"the URDF has {len(leaves)} ends; name the tool frame: {', '.join(leaves[:20])}")
        tool = leaves[0]
    for frame in (base, tool):
        if frame not in urdf.links:
            raise RobotError(f"the URDF has no link '{frame}'")
    chain = serial_robot(urdf, base, tool, config.joints, config.complete)
    placed = Mount(chain.tool_frame @ config.mount().transform_flange_to_link, config.hold)
    home = [config.home.get(name, joint.rest) for name, joint in zip(chain.names, chain.joints, strict=True)]
    return RobotParts(
        config.name, config.title, config.source, chain.joints, chain.visuals, placed, home, config.upright, chain.notes
    )


def _config(data: dict[str, Any]) -> RobotConfig:
    check_keys(data, _KEYS, "the configuration")
    if data.get("units", UNITS) != UNITS:
        raise RobotError("the units of a configuration are mm and rad")
    try:
        mount = data.get("tool_mount", {})
        check_keys(mount, {"xyz", "rpy", "hold"}, "tool_mount")
        return RobotConfig(
            name=str(data["name"]),
            title=str(data["title"]),
            source=str(data["source"]),
            urdf=str(data["urdf"]),
            base_frame=None if data.get("base_frame") is None else str(data["base_frame"]),
            tool_frame=None if data.get("tool_frame") is None else str(data["tool_frame"]),
            mount_xyz=_three(mount.get("xyz", (0.0, 0.0, 0.0))),
            mount_rpy=_three(mount.get("rpy", Z_ALONG_SHAFT)),
            hold=str(mount.get("hold", "tail")),
            upright=_boolean(data.get("stands", False)),
            home={str(name): _number(value) for name, value in data.get("home", {}).items()},
            joints={str(name): _joint_config(str(name), entry) for name, entry in data.get("joints", {}).items()},
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise RobotError(f"the configuration: {error!r} is missing or not usable") from error


def _joint_config(name: str, entry: Mapping[str, Any]) -> JointConfig:
    check_keys(entry, _JOINT_KEYS, f"joint '{name}'")
    values = {key: _number(entry[key]) for key in (*_NUMBERS, "weight") if key in entry}
    if set(values) & set(_NUMBERS) and not str(entry.get("source", "")).strip():
        raise RobotError(f"joint '{name}': its numbers need a source, which may be 'assumed'")
    return JointConfig(title=str(entry.get("title", name)), source=str(entry.get("source", "URDF")), **values)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise ValueError(f"{value!r} is no finite number")
    return float(value)


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = values
    return _number(x), _number(y), _number(z)


def _boolean(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{value!r} is not true or false")
    return value
