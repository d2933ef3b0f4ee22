"""What is asked of a driven snake in one step, in millimetres a second."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from ....arrays import Array
from ....errors import InputError

MOST_MM_PER_S = 1000.0  # ten joints at 36°/s, each with all five links ahead of it, are slower


@dataclass(frozen=True)
class SnakeCommand:
    """What the operator asks for; what is not finite is left out, counts as nothing asked for, and is counted.

    Insertion comes first: in a step that inserts the tip is not bent, and the state says so.

    insert_mm_per_s: forwards, negative backwards.
    camera_mm_per_s: of the camera in its picture's plane, x to the right, y down.
    straighten: bring the manipulated links back to the shape that conforms.
    bend: (2L',) rad by which the manipulated joints are to differ from the conforming shape, as far as a step goes; it
        comes before a camera command. None: no such command.

    Raises:
        InputError: values that are no real numbers, or a camera command that is not two of them.
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
        """Whether all its numbers are."""
        numbers = (self.insert_mm_per_s, *self.camera_mm_per_s, *(self.bend or ()))
        return all(map(math.isfinite, numbers))

    @property
    def cleaned(self) -> SnakeCommand:
        """Without what is not finite: the insertion, the whole camera command or the whole bend; the rest stays."""
        camera = self.camera_mm_per_s if all(map(math.isfinite, self.camera_mm_per_s)) else (0.0, 0.0)
        bend = self.bend if self.bend is not None and all(map(math.isfinite, self.bend)) else None
        insert = self.insert_mm_per_s if math.isfinite(self.insert_mm_per_s) else 0.0
        return SnakeCommand(insert, camera, self.straighten, bend)

    @property
    def bends(self) -> bool:
        """Whether the manipulated links are to move."""
        return self.straighten or any(self.camera_mm_per_s) or self.bend is not None

    @property
    def camera(self) -> Array:
        """The camera command (2,) in mm/s, no faster than any camera on a snake goes."""
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
