"""Actual start and end of a driven path, and their distances from the requested positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...geometry.curve import Curve
from ...validate import point_text

MOVED_MM = 5.0  # distance of an end from its requested position above which there is a warning


@dataclass(frozen=True)
class PathEnds:
    """start, end: of the path as driven, LPS mm; start_moved_mm, end_moved_mm: from the requested positions."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    start_moved_mm: float
    end_moved_mm: float

    @classmethod
    def of(cls, curve: Curve, start: ArrayLike, end: ArrayLike) -> PathEnds:
        """Compare the ends of a curve (mm) with the two requested positions (3,)."""
        first, last = curve.position(0.0), curve.position(curve.length)
        away = [float(np.linalg.norm(at - np.asarray(asked))) for at, asked in ((first, start), (last, end))]
        return cls(_triple(first), _triple(last), *away)

    def warnings(self) -> list[str]:
        """Describe which end is not where it was requested."""
        return [
            f"the path {verb} at {point_text(place)}, {moved:.1f} mm from the {name} that was asked for: "
            "it is a smooth curve through the widest places near by"
            for name, verb, place, moved in (
                ("start", "begins", self.start, self.start_moved_mm),
                ("end", "ends", self.end, self.end_moved_mm),
            )
            if moved > MOVED_MM
        ]


def _triple(place: Array) -> tuple[float, float, float]:
    x, y, z = place.tolist()
    return x, y, z
