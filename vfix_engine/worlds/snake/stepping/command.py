"""The command to a driven snake for one step, in millimetres a second."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from ....arrays import Array
from ....errors import InputError

MOST_MM_PER_S = 1000.0  # faster than ten joints at 36°/s, each with all five links ahead of it


@dataclass(frozen=True)
class SnakeCommand:
    """A command of the operator; non-finite parts are ignored and counted.

    Insertion takes precedence: a step that inserts does not bend the tip, and the state says so.

    insert_mm_per_s: forwards, negative backwards.
    camera_mm_per_s: velocity of the camera in its picture's plane, x to the right, y down.
    straighten: bring the manipulated links back to the shape that conforms.
    bend: (2L',) rad, desired difference of the manipulated joints from the conforming shape, as far as a step goes; it
        takes precedence over a camera command. None: no such command.

    Raises:
        InputError: values that are not real numbers, or a camera command that is not two of them.
    """

    insert_mm_per_s: float = 0.0
    camera_mm_per_s: tuple[float, float] = (0.0, 0.0)
    straighten: bool = False
    bend: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "insert_mm_per_s", _real("insert_mm_per_s", self.insert_mm_per_s))
        camera: Any = self.camera_mm_per_s
        if isinstance(camera, str) or not hasattr(camera, "__len__") or len(camera) != 2:
            raise InputError(f"camera_mm_per_s is two numbers, x and y, not {camera!r}")
        x, y = camera
        object.__setattr__(self, "camera_mm_per_s", (_real("camera_mm_per_s", x), _real("camera_mm_per_s", y)))
        if not isinstance(self.straighten, bool | np.bool_):
            raise InputError(f"straighten is true or false, not {self.straighten!r}")
        bend: Any = self.bend
        if bend is not None:
            if isinstance(bend, str) or not hasattr(bend, "__len__"):
                raise InputError(f"bend is two numbers for each manipulated link, not {bend!r}")
            object.__setattr__(self, "bend", tuple(_real("bend", value) for value in bend))

    @property
    def finite(self) -> bool:
        """Whether all its numbers are finite."""
        numbers = (self.insert_mm_per_s, *self.camera_mm_per_s, *(self.bend or ()))
        return all(map(math.isfinite, numbers))

    @property
    def cleaned(self) -> SnakeCommand:
        """Without non-finite parts: the insertion, the whole camera command or the whole bend."""
        camera = self.camera_mm_per_s if all(map(math.isfinite, self.camera_mm_per_s)) else (0.0, 0.0)
        bend = self.bend if self.bend is not None and all(map(math.isfinite, self.bend)) else None
        insert = self.insert_mm_per_s if math.isfinite(self.insert_mm_per_s) else 0.0
        return SnakeCommand(insert, camera, self.straighten, bend)

    @property
    def bends(self) -> bool:
        """Whether the command moves the manipulated links."""
        return self.straighten or any(self.camera_mm_per_s) or self.bend is not None

    @property
    def camera(self) -> Array:
        """The camera command (2,) in mm/s, limited to the largest speed of any snake's camera."""
        x, y = self.camera_mm_per_s
        size = math.hypot(x, y)
        return np.array([x, y]) * min(1.0, MOST_MM_PER_S / size) if size > 0.0 else np.zeros(2)


def _real(name: str, value: Any) -> float:
    if type(value) is float:
        return value
    if not isinstance(value, bool) and isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    raise InputError(f"{name} takes real numbers, not {value!r}")
