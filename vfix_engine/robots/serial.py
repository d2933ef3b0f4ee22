"""Extraction of the chain of joints that moves the tool from a URDF tree; all other links are fixed and only drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import RobotError
from .joints import Joint, Visual
from .urdf import Urdf, UrdfJoint
from .urdf_tree import joint_chain

ASSUMED_SPEED = {"prismatic": 60.0, "revolute": 1.0}  # [mm/s], [rad/s] if a plain URDF has none
ASSUMED_STOP_S = 0.05  # time from top speed to a stop that gives the acceleration assumed for a plain URDF
CONTINUOUS_RANGE = 8 * 2 * np.pi  # [rad] in either direction: a joint without limits still gets a finite range


@dataclass(frozen=True)
class JointConfig:
    """Values of a configuration for one joint, in mm and rad; None selects that of the URDF. weight: see ``Joint``."""

    title: str
    source: str
    lower: float | None = None
    upper: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    weight: float | None = None


@dataclass(frozen=True, eq=False)
class SerialChain:
    """names: of the joints in the URDF; tool_frame: transform_tool_frame_to_link (4, 4), to the last joint's link."""

    names: tuple[str, ...]
    joints: tuple[Joint, ...]
    tool_frame: Array
    visuals: tuple[Visual, ...]
    notes: tuple[str, ...]


def serial_robot(urdf: Urdf, base: str, tool: str, config: Mapping[str, JointConfig], complete: bool) -> SerialChain:
    """Collect the joints from the base link to the tool link; fixed ones become placements between the others.

    Args:
        base, tool: names of links.
        config: by name of the joint.
        complete: refuse values missing in both the URDF and ``config``; otherwise they are assumed and noted.

    Raises:
        RobotError: there is no chain from base to tool, no joint on it, a mimic joint, or a missing number.
    """
    edges = [(joint.name, joint.parent, joint.child) for joint in urdf.joints]
    names, joints, notes = [], [], []
    before = np.eye(4)
    frames = {base: (0, before)}  # link → index of the moving link it is fixed to, transform to that link
    for index in joint_chain(edges, base, tool):
        given = urdf.joints[index]
        before = before @ given.origin
        if given.kind != "fixed":
            if given.mimics is not None:
                raise RobotError(f"joint '{given.name}' mimics '{given.mimics}': that cannot be controlled as a chain")
            joint, assumed = _joint(given, config.get(given.name), before, complete)
            names.append(given.name)
            joints.append(joint)
            notes += assumed
            before = np.eye(4)
        frames[given.child] = (len(joints), before)
    visuals, left_out = _drawn(urdf, frames)
    return SerialChain(tuple(names), tuple(joints), before, visuals, tuple(notes) + left_out)


def _joint(given: UrdfJoint, config: JointConfig | None, placement: Array, complete: bool) -> tuple[Joint, list[str]]:
    """Return the joint, where the configuration takes precedence over the URDF, and the assumptions made."""
    known = config or JointConfig(given.name, "URDF")
    kind = "prismatic" if given.kind == "prismatic" else "revolute"
    where, assumed = f"joint '{given.name}'", []
    lower = given.lower if known.lower is None else known.lower
    upper = given.upper if known.upper is None else known.upper
    if given.kind == "continuous" and (lower is None or upper is None):
        lower, upper = -CONTINUOUS_RANGE, CONTINUOUS_RANGE
        assumed.append(f"{where} has no limits: eight turns either way are assumed")
    if lower is None or upper is None:
        raise RobotError(f"{where} has no limits; the file or a configuration has to say them")
    speed = known.speed if known.speed is not None else given.velocity or None
    if speed is None and complete:
        raise RobotError(f"{where} has no speed in the URDF; the configuration has to say one")
    if speed is None:
        speed = ASSUMED_SPEED[kind]
        assumed.append(f"{where} has no speed: {speed:g} {'mm' if kind == 'prismatic' else 'rad'}/s is assumed")
    acceleration = known.acceleration
    if acceleration is None and complete:
        raise RobotError(f"{where} has no acceleration; the configuration has to say one")
    if acceleration is None:
        acceleration = speed / ASSUMED_STOP_S
        assumed.append(f"{where} has no acceleration: a stop from top speed within {ASSUMED_STOP_S:g} s is assumed")
    if lower == upper:
        assumed.append(f"{where} has an empty range and does not move")
    source = "; ".join([known.source, *(note.removeprefix(f"{where} ") for note in assumed)])
    joint = Joint(known.title, kind, given.axis, lower, upper, speed, acceleration, source, placement, known.weight)
    return joint, assumed


def _drawn(urdf: Urdf, frames: dict[str, tuple[int, Array]]) -> tuple[tuple[Visual, ...], tuple[str, ...]]:
    """Return the shapes of every link at or below the base; joints outside the chain are at 0."""
    frames = dict(frames)
    below: dict[str, list[UrdfJoint]] = {}
    for joint in urdf.joints:
        below.setdefault(joint.parent, []).append(joint)
    waiting, still, notes = list(frames), [], []
    while waiting:
        link = waiting.pop(0)
        number, transform = frames[link]
        for joint in below.get(link, []):
            if joint.child not in frames:
                frames[joint.child] = (number, transform @ joint.origin)
                waiting.append(joint.child)
                if joint.kind != "fixed":
                    still.append(joint.name)
    if still:
        notes.append(f"not between base and tool, drawn at 0: {_listed(still)}")
    above = [link for link in urdf.links if link not in frames]
    if above:
        notes.append(f"not below the base frame, not drawn: {_listed(above)}")
    visuals, missing = [], []
    for link, (number, transform) in frames.items():
        for shape in urdf.links[link]:
            if shape.file is not None and not shape.file.is_file():
                missing.append(shape.file.name)
                continue
            place = transform @ shape.origin
            x, y, z = (float(v) for v in place[:3, 3])
            visuals.append(Visual(number, shape.kind, shape.size, (x, y, z), shape.colour, place[:3, :3], shape.file))
    if missing:
        notes.append(f"meshes that are not there, not drawn: {_listed(missing)}")
    return tuple(visuals), tuple(notes)


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - 10} more" if len(names) > 10 else ""
    return ", ".join(names[:10]) + more
