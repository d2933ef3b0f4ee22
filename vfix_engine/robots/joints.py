"""Parts of a serial robot: joints with fixed placements between them, shapes for display, the tool's mount."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import RobotError
from .description import check_transform
from .tool import HOLDS

MOST_JOINTS = 32  # between base and tool frame: the cost of a control step grows with the square of their number
_EDGE = 0.1  # fraction of a joint's range at either end that is avoided as the default position


def _identity() -> Array:
    return np.eye(4)


@dataclass(frozen=True)
class Joint:
    """One joint: range, speed and acceleration in mm, mm/s, mm/s² (prismatic) or rad, rad/s, rad/s² (revolute).

    kind: 'prismatic' or 'revolute'.
    axis: unit vector in the joint's own frame.
    range_source: origin of the limits, for display.
    placement: transform_joint_to_parent (4, 4) at q = 0, mm; the parent is the previous joint's frame or the base.
    weight: relative cost of its motion; None takes ``JOINT_WEIGHT``.

    Raises:
        RobotError: the kind is unknown, the axis is not a unit vector, a number is not finite, the range is empty, or a
            speed, acceleration or weight is not positive.
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
        """Default position: 0, or the middle of the range if 0 is outside its inner part."""
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


@dataclass(frozen=True)
class RobotParts:
    """Validated parts of a ``RobotModel``; see there for the fields and the errors."""

    name: str
    title: str
    source: str
    joints: tuple[Joint, ...]
    visuals: tuple[Visual, ...] = ()
    mount: Mount = field(default_factory=Mount)
    home: ArrayLike | None = None
    upright: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.joints:
            raise RobotError(f"robot '{self.name}' has no joint between its base and its tool frame")
        if len(self.joints) > MOST_JOINTS:
            raise RobotError(
                f"robot '{self.name}' has {len(self.joints):,} moving joints between its base and its tool frame; "
                f"at most {MOST_JOINTS} can be controlled"
            )
        home = np.array([joint.rest for joint in self.joints] if self.home is None else self.home, dtype=float)
        if home.shape != (len(self.joints),) or not np.isfinite(home).all():
            raise RobotError(f"robot '{self.name}': home needs {len(self.joints)} finite joint values")
        for joint, value in zip(self.joints, home, strict=True):
            if not joint.lower <= value <= joint.upper:
                raise RobotError(
                    f"joint '{joint.name}': home {value:g} {joint.unit} is outside {joint.lower:g} … {joint.upper:g}"
                )
        object.__setattr__(self, "home", home)
