"""URDF reader: every element in use is validated before anything is built from it (HAZ-23).

Metres are converted to millimetres here; results are in mm and rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from ..arrays import Array
from ..errors import RobotError
from .description import MAX_FILE_BYTES
from .urdf_numbers import MAX_ANGLE, MAX_LENGTH_M, MAX_RATE, MM_PER_M, number, numbers, read_origin, short
from .urdf_shapes import UrdfShape, check_file_names, materials, read_shapes
from .urdf_tree import check_tree
from .xml_reader import Element, read_xml

KINDS = ("revolute", "continuous", "prismatic", "fixed")
_NAME_LENGTH = 200


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint of the file, in mm and rad; None where the file has no value.

    origin: transform_child_to_parent at q = 0 (4, 4); axis: unit vector in the child's frame.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: tuple[float, float, float]
    lower: float | None
    upper: float | None
    velocity: float | None
    mimics: str | None


@dataclass(frozen=True, eq=False)
class Urdf:
    """A checked URDF: links with their shapes, joints in the file's order, and the root link."""

    name: str
    links: dict[str, tuple[UrdfShape, ...]]
    joints: tuple[UrdfJoint, ...]
    root: str

    def leaves(self) -> tuple[str, ...]:
        """Links without a child."""
        parents = {joint.parent for joint in self.joints}
        return tuple(link for link in self.links if link not in parents)


def parse_urdf(data: bytes, folder: Path) -> Urdf:
    """Read and check a URDF.

    Args:
        data: the file.
        folder: of the file; meshes must lie inside it (HAZ-19).

    Raises:
        RobotError: the message names the element and the reason (HAZ-19, HAZ-20, HAZ-23).
    """
    if len(data) > MAX_FILE_BYTES:
        raise RobotError(f"a URDF is not larger than {MAX_FILE_BYTES >> 20} MiB")
    robot = read_xml(data)
    if robot.tag != "robot":
        raise RobotError(f"the outermost element is <{short(robot.tag)}>, not <robot>")
    _no_xacro(robot)
    check_file_names(robot, folder)
    colours = materials(robot)
    links: dict[str, tuple[UrdfShape, ...]] = {}
    for element in robot.all("link"):
        name = _name(element, "link")
        if name in links:
            raise RobotError(f"two links are called '{name}'")
        _check_inertia(element, name)
        links[name] = read_shapes(element, name, folder, colours)
    if not links:
        raise RobotError("there is no link")
    joints = tuple(_joint(element) for element in robot.all("joint"))
    root = check_tree(tuple(links), [(joint.name, joint.parent, joint.child) for joint in joints])
    _check_mimics(joints)
    return Urdf(robot.attributes.get("name", "").strip()[:_NAME_LENGTH], links, joints, root)


def _joint(element: Element) -> UrdfJoint:
    name = _name(element, "joint")
    where = f"joint '{name}'"
    kind = element.attributes.get("type", "")
    if kind not in KINDS:
        raise RobotError(f"{where} is of type '{short(kind)}'; this planner moves {', '.join(KINDS[:3])} joints")
    parent, child = (_linked(element, end, where) for end in ("parent", "child"))
    origin = read_origin(element, where)
    axis = (1.0, 0.0, 0.0)
    given = element.first("axis")
    if given is not None and kind != "fixed":
        x, y, z = numbers(given.attributes.get("xyz", "1 0 0"), 3, f"{where}: axis")
        size = math.hypot(x, y, z)
        if not 1e-6 < size < 1e6:
            raise RobotError(f"{where}: the axis {x:g} {y:g} {z:g} has no direction")
        axis = (x / size, y / size, z / size)
    lower, upper, velocity = _limits(element, kind, where)
    dynamics = element.first("dynamics")
    for key in ("damping", "friction") if dynamics is not None else ():
        _rate(dynamics, key, f"{where}: {key}")
    mimic = element.first("mimic")
    mimics = None if mimic is None else short(mimic.attributes.get("joint", ""))
    return UrdfJoint(name, kind, parent, child, origin, axis, lower, upper, velocity, mimics)


def _limits(element: Element, kind: str, where: str) -> tuple[float | None, float | None, float | None]:
    """Lower, upper and velocity; a missing bound of a limit is 0 by the URDF standard."""
    limit = element.first("limit")
    if limit is None or kind == "fixed":
        return None, None, None
    scale, most = (MM_PER_M, MAX_LENGTH_M) if kind == "prismatic" else (1.0, MAX_ANGLE)
    _rate(limit, "effort", f"{where}: effort")
    velocity = _rate(limit, "velocity", f"{where}: velocity")
    velocity = None if velocity is None else scale * velocity
    if kind == "continuous":
        return None, None, velocity
    lower, upper = (number(limit.attributes.get(end, "0"), f"{where}: {end}", most) for end in ("lower", "upper"))
    if lower > upper:
        raise RobotError(f"{where}: its lower limit {lower:g} is above its upper limit {upper:g}")
    return scale * lower, scale * upper, velocity


def _rate(element: Element | None, key: str, what: str) -> float | None:
    """Non-negative number, or None if it is missing."""
    text = None if element is None else element.attributes.get(key)
    if text is None:
        return None
    value = number(text, what, MAX_RATE)
    if value < 0:
        raise RobotError(f"{what} is {value:g}; it must not be negative")
    return value


def _check_inertia(link: Element, name: str) -> None:
    """Refuse an invalid inertia: inertias are not used, but an invalid one shows that the file is damaged."""
    inertial = link.first("inertial")
    if inertial is None:
        return
    read_origin(inertial, f"link '{name}': inertial")
    mass, inertia = inertial.first("mass"), inertial.first("inertia")
    _rate(mass, "value", f"link '{name}': mass")
    if inertia is not None:
        for key in ("ixx", "iyy", "izz"):
            _rate(inertia, key, f"link '{name}': {key}")
        for key in ("ixy", "ixz", "iyz"):
            number(inertia.attributes.get(key, "0"), f"link '{name}': {key}", MAX_RATE)


def _check_mimics(joints: tuple[UrdfJoint, ...]) -> None:
    names = {joint.name for joint in joints}
    for joint in joints:
        if joint.mimics is not None and (joint.mimics not in names or joint.mimics == joint.name):
            raise RobotError(f"joint '{joint.name}' mimics '{joint.mimics}', which is no other joint")


def _no_xacro(robot: Element) -> None:
    """Refuse macros, which would otherwise be ignored as unknown elements."""
    if any(child.tag.startswith("xacro:") for child in robot.children):
        raise RobotError("this is a xacro file; expand it to URDF first")


def _name(element: Element, what: str) -> str:
    name = element.attributes.get("name", "").strip()
    if not name or len(name) > _NAME_LENGTH or not name.isprintable():
        raise RobotError(f"a {what} has no name, or one that is too long or not printable")
    return name


def _linked(element: Element, end: str, where: str) -> str:
    given = [child.attributes.get("link", "").strip() for child in element.all(end)]
    if len(given) != 1 or not given[0]:
        raise RobotError(f"{where} must name one {end} link")
    return given[0]
