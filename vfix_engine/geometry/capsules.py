"""The tool's shape in one pose: capsules around axis segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Segments:
    """Axis segments of the tool in the patient frame, each with the radius of its capsule.

    Args:
        start: (S, 3) mm.
        end: (S, 3) mm; may coincide with the start (a ball).
        radius: (S,) mm, not negative.

    Raises:
        InputError: wrong shapes, values that are not finite, a negative radius (HAZ-05).
    """

    start: Array
    end: Array
    radius: Array

    def __post_init__(self) -> None:
        start = np.array(self.start, dtype=np.float64, order="C")
        end = np.array(self.end, dtype=np.float64, order="C")
        radius = np.array(self.radius, dtype=np.float64, order="C")
        if start.ndim != 2 or start.shape[1] != 3 or end.shape != start.shape or radius.shape != start.shape[:1]:
            raise InputError(
                f"segments need start (S, 3), end (S, 3), radius (S,), not {start.shape}, {end.shape}, {radius.shape}"
            )
        if not (np.isfinite(start).all() and np.isfinite(end).all() and np.isfinite(radius).all()):
            raise InputError("a segment has a coordinate or radius that is not finite")
        if (radius < 0.0).any():
            raise InputError(f"a segment has the negative radius {radius.min():g} mm")
        for name, value in (("start", start), ("end", end), ("radius", radius)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.radius)
