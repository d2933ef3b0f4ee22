"""Rigid tools: a chain of capsules from the tip to the end of the shaft, and the camera of an endoscope."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import RobotError
from ..geometry.capsules import Segments
from ..validate import point, rotation_matrix
from .description import check_keys, check_transform, read_description

TOOL_SCHEMA = "vfix-tool/2"
UNITS = {"length": "mm", "angle": "deg"}
MAX_PARTS = 8
MOST_BEND = math.radians(120.0)
SHAFT_RADIUS_MM = (0.3, 5.0)  # range of `Tool.shaped`
HOLDS = ("tip", "tail")
_KEYS = {"schema", "name", "title", "source", "units", "parts", "grip_from_bend", "camera"}


@dataclass(frozen=True)
class Part:
    """One capsule: length and radius in mm, and the angle in rad between its axis and the shaft's."""

    name: str
    length: float
    radius: float
    bend: float = 0.0


@dataclass(frozen=True, eq=False)
class Camera:
    """The camera of an endoscope.

    transform_camera_to_tip: (4, 4) in mm; z is the optical axis, x is to the right and y down in the picture.
    field_of_view: full angle of the cone of view, in rad.
    """

    transform_camera_to_tip: Array
    field_of_view: float

    def __post_init__(self) -> None:
        transform = check_transform(self.transform_camera_to_tip, "the camera's placement")
        object.__setattr__(self, "transform_camera_to_tip", transform)
        if not 0.0 < self.field_of_view < math.pi:
            raise RobotError(f"a field of view of {math.degrees(self.field_of_view):g}° is not between 0 and 180°")

    @classmethod
    def looking(cls, tilt: float, field_of_view: float, position: Array, up: Array) -> Camera:
        """Create a camera whose view is tilted by ``tilt`` rad from the shaft (+y) towards +z of the tip frame.

        Args:
            position: (3,) in the tip frame, mm; up: (3,) up in the picture; its component along the view is removed.

        Raises:
            RobotError: the angle is outside 0 … 120°, or up is parallel to the view.
        """
        if not 0.0 <= tilt <= math.radians(120.0):
            raise RobotError(f"a view tilted by {math.degrees(tilt):g}° is not between 0 and 120°")
        view = np.array([0.0, math.cos(tilt), math.sin(tilt)])
        down = -(up - (up @ view) * view)
        size = float(np.linalg.norm(down))
        if not size > 1e-6:
            raise RobotError("the camera's up direction is along its view")
        down = down / size
        transform = np.eye(4)
        transform[:3, :3] = np.column_stack([np.cross(down, view), down, view])
        transform[:3, 3] = position
        return cls(transform, field_of_view)

    @property
    def view(self) -> Array:
        """Unit vector of the view in the tip frame (3,)."""
        view: Array = self.transform_camera_to_tip[:3, 2]
        return view


@dataclass(frozen=True, eq=False)
class Tool:
    """A rigid tool; lengths in mm, angles in rad.

    In the tip frame the shaft runs along +y, every bend is in the y-z plane towards +z, and the first part's axis ends
    at the origin, the tip.
    parts: from the tip backwards, each ends where the previous one begins; the last is the shaft.
    grip_from_bend: distance of the grip from the shaft's front end, in mm.

    Raises:
        RobotError: no part or more than 8, two with the same name, or a length, radius, bend or grip out of range.
    """

    name: str
    title: str
    parts: tuple[Part, ...]
    grip_from_bend: float
    camera: Camera | None = None
    source: str = ""
    radius: Array = field(init=False, repr=False)
    _ends: Array = field(init=False, repr=False)
    _grip: Array = field(init=False, repr=False)
    _axis: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._check()
        ends, front = [], np.zeros(3)
        for part in self.parts:
            back = front - part.length * np.array([0.0, math.cos(part.bend), math.sin(part.bend)])
            ends += [back, front]
            front = back
        first = self.parts[0].bend
        axis = np.array([0.0, math.cos(first), math.sin(first)]) if self.camera is None else self.camera.view
        values = {
            "_ends": np.stack(ends),
            "_grip": ends[-1] - np.array([0.0, self.grip_from_bend, 0.0]),
            "_axis": axis,
            "radius": np.array([part.radius for part in self.parts]),
        }
        for name, value in values.items():
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def _check(self) -> None:
        if not 1 <= len(self.parts) <= MAX_PARTS:
            raise RobotError(f"tool '{self.name}': {len(self.parts)} parts; it has 1 … {MAX_PARTS}")
        for part in self.parts:
            numbers = (part.length, part.radius)
            if not all(math.isfinite(v) and 0 < v < 1000 for v in numbers):
                raise RobotError(f"tool '{self.name}': length and radius of its {part.name} must be 0 … 1000 mm")
            if not 0 <= part.bend <= MOST_BEND:
                raise RobotError(f"tool '{self.name}': the bend of its {part.name} must be 0 … 120°")
        if len(set(self.segment_names)) < len(self.parts):
            raise RobotError(f"tool '{self.name}': two parts have the same name")
        if self.parts[-1].bend != 0:
            raise RobotError(f"tool '{self.name}': the last part is the shaft and has no bend")
        if not 0 <= self.grip_from_bend <= self.parts[-1].length:
            raise RobotError(f"tool '{self.name}': the grip must be on the shaft, 0 … {self.parts[-1].length:g} mm")

    @property
    def segment_names(self) -> tuple[str, ...]:
        """Names of the parts in the order of the segments, from the tip on."""
        return tuple(part.name for part in self.parts)

    @property
    def bend(self) -> float:
        """Angle in rad between the first part's axis and the shaft's; 0 for a straight tool."""
        return self.parts[0].bend

    @property
    def shaft_radius(self) -> float:
        """Radius of the shaft in mm."""
        return self.parts[-1].radius

    def shaped(self, bend: float | None = None, shaft_radius: float | None = None) -> Tool:
        """Return the tool with another bend in rad and another shaft radius in mm; None keeps the present value.

        The bends of all parts are scaled by the same factor, and so are the radii.

        Raises:
            RobotError: the bend is outside 0 … 120°, the tool is straight, or the radius is outside 0.3 … 5 mm.
        """
        bends, radii = 1.0, 1.0
        if bend is not None:
            if not 0.0 <= bend <= MOST_BEND:
                raise RobotError(f"tool '{self.name}': a bend of {math.degrees(bend):g}° is not between 0 and 120°")
            if self.bend == 0.0 and bend != 0.0:
                raise RobotError(f"tool '{self.name}' is straight; it has no bend that could be changed")
            bends = bend / self.bend if self.bend else 1.0
        if shaft_radius is not None:
            low, high = SHAFT_RADIUS_MM
            if not low <= shaft_radius <= high:
                raise RobotError(
                    f"tool '{self.name}': a shaft radius of {shaft_radius:g} mm is not between {low:g} and {high:g} mm"
                )
            radii = shaft_radius / self.shaft_radius
        parts = tuple(replace(part, bend=part.bend * bends, radius=part.radius * radii) for part in self.parts)
        return replace(self, parts=parts)

    @property
    def tip_in_flange(self) -> Array:
        """The tip (3,) in the frame of a flange that holds the tool by its tip: the offset that the bends cause."""
        offset: Array = self.transform_tip_to_flange("tip")[:3, 3]
        return offset

    def transform_tip_to_flange(self, hold: str) -> Array:
        """Tip frame (4, 4) in the frame of the flange, whose y axis is the shaft's.

        hold: the point at the flange's origin: 'tail', the rear end of the shaft, or 'tip', the projection of the tip
        on the axis of the shaft (for a holder that can clamp the shaft anywhere).
        """
        if hold not in HOLDS:
            raise RobotError(f"a tool is held by its {' or its '.join(HOLDS)}, not by '{hold}'")
        transform = np.eye(4)
        transform[:3, 3] = -self._ends[-2]
        if hold == "tip":
            transform[1, 3] = 0.0
        return transform

    @classmethod
    def load(cls, name_or_path: str | Path) -> Tool:
        """Read a tool file, or a shipped tool by its name. Raises RobotError if it is invalid."""
        data = read_description(name_or_path, "tools", TOOL_SCHEMA)
        check_keys(data, _KEYS, "the tool")
        if data.get("units", UNITS) != UNITS:
            raise RobotError("the units of a tool are mm and deg")
        try:
            parts = tuple(_part(entry) for entry in data["parts"])
            camera = None if data.get("camera") is None else _camera(data["camera"])
            return cls(
                name=str(data["name"]),
                title=str(data["title"]),
                parts=parts,
                grip_from_bend=float(data["grip_from_bend"]),
                camera=camera,
                source=str(data["source"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise RobotError(f"tool file {Path(name_or_path).name}: {error!r} is missing or not usable") from error

    def segments(self, rotation: Array, position: Array) -> Segments:
        """The axis segments for a tip frame at rotation (3, 3) and position (3,), in the frame of that pose, mm.

        Raises:
            InputError: the rotation is invalid, or the position is not three finite numbers.
        """
        turn = rotation_matrix(rotation, "the tool's rotation")
        points = self._ends @ turn.T + point("the tool's position", position)
        return Segments(points[0::2], points[1::2], self.radius)

    def grip(self, rotation: Array, position: Array) -> Array:
        """The grip point (3,) of the shaft in mm, for a tip at rotation (3, 3) and position (3,)."""
        grip: Array = rotation @ self._grip + position
        return grip

    def direction(self, rotation: Array) -> Array:
        """Unit vector of the view (3,): an endoscope's camera axis, else the axis of the tip's part."""
        direction: Array = rotation @ self._axis
        return direction


def _part(entry: Mapping[str, Any]) -> Part:
    check_keys(entry, {"name", "length", "radius", "bend"}, "a tool's part")
    bend = math.radians(float(entry.get("bend", 0.0)))
    return Part(str(entry["name"]), float(entry["length"]), float(entry["radius"]), bend)


def _camera(entry: Mapping[str, Any]) -> Camera:
    check_keys(entry, {"position", "tilt", "up", "field_of_view"}, "the camera")
    position, up = (_vector(entry.get(key, default)) for key, default in (("position", (0, 0, 0)), ("up", (0, 0, 1))))
    tilt, field_of_view = float(entry["tilt"]), float(entry["field_of_view"])
    return Camera.looking(math.radians(tilt), math.radians(field_of_view), position, up)


def _vector(values: Any) -> Array:
    vector = np.array([float(v) for v in values])
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ValueError("a camera's position and up have three finite numbers")
    return vector
