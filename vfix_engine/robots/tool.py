"""A bent tool: a straight shaft and a tip portion, each a capsule around its axis."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..errors import RobotError
from ..geometry.capsules import Segments
from .model import read_description

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tool:
    """Lengths and radii in mm, the bend in rad.

    In the tip frame the shaft runs along +y and the tip portion along (0, cos bend, sin bend), ending at the origin.
    Segment 0 is the tip portion, segment 1 the shaft.
    """

    name: str
    title: str
    tip_length: float
    tip_radius: float
    bend: float
    shaft_length: float
    shaft_radius: float
    grip_from_bend: float
    radius: Array = field(init=False, repr=False, compare=False)
    _ends: Array = field(init=False, repr=False, compare=False)
    _grip: Array = field(init=False, repr=False, compare=False)
    _direction: Array = field(init=False, repr=False, compare=False)

    segment_names: ClassVar[tuple[str, ...]] = ("tip", "shaft")

    def __post_init__(self) -> None:
        lengths = (self.tip_length, self.tip_radius, self.shaft_length, self.shaft_radius, self.grip_from_bend)
        if not all(math.isfinite(v) and 0 < v < 1000 for v in lengths) or not 0 <= self.bend <= math.radians(120):
            raise RobotError(f"tool '{self.name}': lengths must be 0 … 1000 mm and the bend 0 … 120°")
        direction = np.array([0.0, math.cos(self.bend), math.sin(self.bend)])
        elbow = -self.tip_length * direction
        tail = elbow - np.array([0.0, self.shaft_length, 0.0])
        object.__setattr__(self, "_ends", np.stack([elbow, np.zeros(3), tail, elbow]))
        object.__setattr__(self, "_grip", elbow - np.array([0.0, self.grip_from_bend, 0.0]))
        object.__setattr__(self, "_direction", direction)
        radius = np.array([self.tip_radius, self.shaft_radius])
        radius.setflags(write=False)
        object.__setattr__(self, "radius", radius)

    @property
    def tip_in_flange(self) -> Array:
        """The tip (3,) in the frame of the flange that holds the shaft along its y axis: off the axis by the bend."""
        return np.array([0.0, 0.0, self.tip_length * math.sin(self.bend)])

    @classmethod
    def load(cls, name_or_path: str | Path) -> Tool:
        """Read a tool file, or a shipped tool by its name; RobotError says what is wrong with it."""
        data = read_description(name_or_path, "tools", "vfix-tool/1")
        try:
            numbers = {
                key: float(data[key])
                for key in ("tip_length", "tip_radius", "shaft_length", "shaft_radius", "grip_from_bend")
            }
            return cls(name=str(data["name"]), title=str(data["title"]), bend=math.radians(data["bend"]), **numbers)
        except (KeyError, TypeError, ValueError) as error:
            raise RobotError(f"tool file {Path(name_or_path).name}: {error!r} is missing or not a number") from error

    def segments(self, rotation: Array, position: Array) -> Segments:
        """The tool's axis segments with the tip frame at (rotation, position), in the frame of that pose."""
        points = self._ends @ rotation.T + position
        return Segments(points[0::2], points[1::2], self.radius)

    def grip(self, rotation: Array, position: Array) -> Array:
        """The point of the shaft that the hand holds (3,)."""
        grip: Array = rotation @ self._grip + position
        return grip

    def direction(self, rotation: Array) -> Array:
        """Unit vector along the tip portion, which is the optical axis of an endoscope (3,)."""
        direction: Array = rotation @ self._direction
        return direction

    def reach(self) -> float:
        """Bound of the distance of any point of the axis from the flange's origin, in mm (for motion bounds)."""
        return 2.0 * self.tip_length + self.shaft_length
