"""The shape of the tool in one pose: capsules around axis segments."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array
from ..errors import InputError


@dataclass(frozen=True, eq=False)
class Segments:
    """Axis segments of the tool in the patient frame, each with the radius of its capsule.

    Args:
        start: (S, 3) mm.
        end: (S, 3) mm; may coincide with the start (a ball).
        radius: (S,) mm, not negative.

    ``packed`` (7 S,) holds all three in one array, since a kernel call costs time per array.

    Raises:
        InputError: wrong shapes, values that are not finite, a negative radius (HAZ-05).
    """

    start: Array
    end: Array
    radius: Array
    packed: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        start, end = np.asarray(self.start, dtype=np.float64), np.asarray(self.end, dtype=np.float64)
        radius = np.asarray(self.radius, dtype=np.float64)
        if start.ndim != 2 or start.shape[1] != 3 or end.shape != start.shape or radius.shape != start.shape[:1]:
            raise InputError(
                f"segments need start (S, 3), end (S, 3), radius (S,), not {start.shape}, {end.shape}, {radius.shape}"
            )
        packed = np.concatenate((start.ravel(), end.ravel(), radius))
        if not np.isfinite(packed).all():
            raise InputError("a segment has a coordinate or radius that is not finite")
        if (radius < 0.0).any():
            raise InputError(f"a segment has the negative radius {radius.min():g} mm")
        packed.setflags(write=False)
        count = len(radius)
        object.__setattr__(self, "packed", packed)
        object.__setattr__(self, "start", packed[: 3 * count].reshape(count, 3))
        object.__setattr__(self, "end", packed[3 * count : 6 * count].reshape(count, 3))
        object.__setattr__(self, "radius", packed[6 * count :])

    def __len__(self) -> int:
        return len(self.radius)
