"""Data of a serial robot: joints with fixed placements between them, and the frame that holds the tool."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import RobotError
from ..given import real_array
from .description import check_transform
from .placed import PlacedRobot
from .tool import HOLDS, Tool

Array = NDArray[np.float64]

MOST_JOINTS = 32  # between base and tool frame: the cost of a control step grows with the square of their number
# Default cost of a millimetre and of a radian of joint motion. A rotation about a remote centre moves the whole shaft:
# a radian costs as much as 50 mm of translation, the displacement of a point a third up a shaft of 150 mm.
JOINT_WEIGHT = {"prismatic": 1.0, "revolute": 50.0}
_EDGE = 0.1  # share of a joint's range at either end in which it does not start


def _identity() -> Array:
    return np.eye(4)


@dataclass(frozen=True)
class Joint:
    """One joint: range, speed and acceleration in mm, mm/s, mm/s² (prismatic) or rad, rad/s, rad/s² (revolute).

    kind: 'prismatic' or 'revolute'.
    axis: unit vector in the joint's own frame.
    range_source: where the numbers come from, for people.
    placement: transform_joint_to_parent (4, 4) at q = 0, mm; the parent is the previous joint's frame or the base.
    weight: relative cost of its motion; None takes ``JOINT_WEIGHT``.

    Raises:
        RobotError: an unknown kind, an axis that is not a unit vector, a non-finite number, an empty range, a speed,
            acceleration or weight that is not positive.
    """

    name: str
    kind: str
    axis: tuple[float, float, float]
    lower: float
    upper: float
    speed: float
    acceleration: float
    range_source: str
    placement: Array = field(default_factory=_identity, repr=False, compare=False)
    weight: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in ("prismatic", "revolute"):
            raise RobotError(f"joint '{self.name}': kind '{self.kind}' is not prismatic or revolute")
        numbers = (*self.axis, self.lower, self.upper, self.speed, self.acceleration)
        if not all(math.isfinite(v) for v in numbers) or abs(math.hypot(*self.axis) - 1) > 1e-9:
            raise RobotError(f"joint '{self.name}': axis must have length 1 and every number be finite")
        if not self.lower <= self.upper:
            raise RobotError(f"joint '{self.name}': range {self.lower:g} … {self.upper:g} is empty")
        if self.speed <= 0 or self.acceleration <= 0:
            raise RobotError(
                f"joint '{self.name}': speed {self.speed:g} and acceleration {self.acceleration:g} must be positive"
            )
        if self.weight is not None and not 0.0 < self.weight < math.inf:
            raise RobotError(f"joint '{self.name}': weight {self.weight!r} must be a finite number above 0")
        placement = check_transform(self.placement, f"the placement of joint '{self.name}'")
        object.__setattr__(self, "placement", placement)

    @property
    def rest(self) -> float:
        """Default position: 0, or the middle of the range where 0 is outside of its inner part."""
        edge = _EDGE * (self.upper - self.lower)
        return 0.0 if self.lower + edge <= 0.0 <= self.upper - edge else 0.5 * (self.lower + self.upper)

    @property
    def unit(self) -> str:
        """Unit of the range: 'mm' (prismatic) or 'rad' (revolute)."""
        return "mm" if self.kind == "prismatic" else "rad"


@dataclass(frozen=True)
class Visual:
    """A shape fixed to a link, for display; lengths in mm.

    kind and size: 'box' (x, y, z), 'cylinder' (radius, length along z, 0), 'sphere' (radius, 0, 0), 'mesh' (scale along
    x, y, z from the file's unit to mm).
    link: 0 is the base, k moves with joint k; position (3,) and rotation (3, 3) in that link's frame.
    file: of a mesh, inside the folder of its robot (HAZ-19); the engine does not open it.
    """

    link: int
    kind: str
    size: tuple[float, float, float]
    position: tuple[float, float, float]
    colour: tuple[int, int, int]
    rotation: Array = field(default_factory=lambda: np.eye(3), repr=False, compare=False)
    file: Path | None = None


@dataclass(frozen=True)
class Mount:
    """The frame in which a robot holds its tool.

    transform_flange_to_link: (4, 4) in mm, the frame that holds the tool in the last joint's moving frame; the tool's
    shaft runs along its y axis.
    hold: see ``Tool.transform_tip_to_flange``.
    """

    transform_flange_to_link: Array = field(default_factory=_identity, repr=False, compare=False)
    hold: str = "tip"

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "transform_flange_to_link", check_transform(self.transform_flange_to_link, "the tool's mount")
        )
        if self.hold not in HOLDS:
            raise RobotError(f"a tool is held by its {' or its '.join(HOLDS)}, not by '{self.hold}'")


class RobotModel:
    """Data of a serial robot: joints from the base outwards, and the mount of the tool.

    lower, upper, speed, acceleration: (n,) joint limits in mm and rad.
    home: (n,) joints from which placing starts, in mm and rad.
    revolute: (n,) bool.
    joint_weights: (n,) relative cost of a mm or rad of each joint's motion, W_j of Li 2007, eq. (19).
    upright: whether the base stays upright when the robot is placed; else its pose follows from the tool's.
    notes: sentences on what was assumed or left out when the description was read.

    Raises:
        RobotError: no joint, more than 32 of them (HAZ-23), or a home outside the joints' ranges.
    """

    def __init__(
        self,
        name: str,
        title: str,
        source: str,
        joints: tuple[Joint, ...],
        visuals: tuple[Visual, ...] = (),
        mount: Mount | None = None,
        home: ArrayLike | None = None,
        upright: bool = False,
        notes: tuple[str, ...] = (),
    ):
        if not joints:
            raise RobotError(f"robot '{name}' has no joint between its base and its tool frame")
        if len(joints) > MOST_JOINTS:
            raise RobotError(
                f"robot '{name}' has {len(joints):,} moving joints between its base and its tool frame; "
                f"at most {MOST_JOINTS} can be controlled"
            )
        self.name, self.title, self.source, self.joints, self.visuals = name, title, source, joints, visuals
        self.mount, self.upright, self.notes = mount or Mount(), upright, notes
        self.lower = np.array([j.lower for j in joints])
        self.upper = np.array([j.upper for j in joints])
        self.speed = np.array([j.speed for j in joints])
        self.acceleration = np.array([j.acceleration for j in joints])
        self.revolute = np.array([j.kind == "revolute" for j in joints])
        self.joint_weights = np.array([JOINT_WEIGHT[j.kind] if j.weight is None else j.weight for j in joints])
        self.home = np.array([joint.rest for joint in joints] if home is None else home, dtype=float)
        if self.home.shape != self.lower.shape or not np.isfinite(self.home).all():
            raise RobotError(f"robot '{name}': home needs {len(joints)} finite joint values")
        for joint, value in zip(joints, self.home, strict=True):
            if not joint.lower <= value <= joint.upper:
                raise RobotError(
                    f"joint '{joint.name}': home {value:g} {joint.unit} is outside {joint.lower:g} … {joint.upper:g}"
                )
        fixed = (self.lower, self.upper, self.speed, self.acceleration, self.revolute, self.home, self.joint_weights)
        for array in fixed:
            array.setflags(write=False)

    @classmethod
    def load(cls, name_or_path: str | Path, tool_frame: str | None = None) -> RobotModel:
        """Read a shipped robot by its name, a configuration (``vfix-robot/2``, .json) or a plain URDF (.urdf).

        Args:
            name_or_path: name of a shipped robot, or path of a file.
            tool_frame: link that holds the tool, instead of that of the configuration; required for a URDF with several
                leaf links. The shaft runs along its z axis unless a configuration sets a mount.

        Raises:
            RobotError: the file is missing, unreadable or inconsistent (HAZ-19, HAZ-20, HAZ-23).
        """
        from .config import load_robot  # imported here: config imports this module

        return load_robot(name_or_path, tool_frame)

    @classmethod
    def from_pinocchio(
        cls, model: Any, tip_frame: str, weights: Mapping[str, float] | None = None, hold: str = "tail"
    ) -> RobotModel:
        """The chain of a ``pinocchio.Model`` (metres) from its universe to a frame; other joints are dropped.

        Args:
            tip_frame: frame that holds the tool; the tool's shaft runs along its z axis.
            model: the Pinocchio model.
            weights: of joints by name, see ``Joint``; hold: see ``Mount``.

        Values that a Pinocchio model lacks are assumed as for a plain URDF and listed in ``notes``: accelerations, and
        infinite speeds and ranges.

        Raises:
            RobotError: no such frame, a joint on the chain that is neither revolute nor prismatic, or a prismatic joint
                without limits.
        """
        from .from_pinocchio import robot_from_pinocchio  # imported here: it imports this module

        return robot_from_pinocchio(model, tip_frame, weights, hold)

    def transform_tip_to_link(self, tool: Tool) -> Array:
        """transform_tip_to_link (4, 4) in mm of a mounted tool; the link is the last joint's moving frame."""
        transform: Array = self.mount.transform_flange_to_link @ tool.transform_tip_to_flange(self.mount.hold)
        return transform

    def placed(self, base: ArrayLike, tip: Tool | ArrayLike | None = None) -> PlacedRobot:
        """The robot with its base at transform_base_to_patient (4, 4) in mm.

        Args:
            base: rigid transform (4, 4).
            tip: a tool, or a tip frame in the flange: transform (4, 4) or offset (3,) in mm; None is the flange.

        Raises:
            RobotError: base or tip is not a rigid transform.
        """
        if isinstance(tip, Tool):
            return PlacedRobot(self, base, self.transform_tip_to_link(tip))
        transform = np.eye(4)
        if tip is not None:
            given = real_array("the tip's placement", tip, RobotError)
            if given.shape == (3,):
                transform[:3, 3] = given
            else:
                transform = check_transform(given, "the tip's placement")
        return PlacedRobot(self, base, self.mount.transform_flange_to_link @ transform)
