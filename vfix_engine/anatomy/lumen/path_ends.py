"""Where a driven path really begins and ends, and how far that is from the places that were asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...geometry.curve import Curve
from ...kernels.triples import triple
from ...validate import point_text

MOVED_MM = 5.0  # an end that is farther from where it was asked for is warned of


@dataclass(frozen=True)
class PathEnds:
    """start, end: of the path as driven, LPS mm; start_moved_mm, end_moved_mm: from the places asked for."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    start_moved_mm: float
    end_moved_mm: float

    @classmethod
    def of(cls, curve: Curve, start: ArrayLike, end: ArrayLike) -> PathEnds:
        """Of a curve (mm) and the two places (3,) asked for."""
        first, last = curve.position(0.0), curve.position(curve.length)
        away = [float(np.linalg.norm(at - np.asarray(asked))) for at, asked in ((first, start), (last, end))]
        return cls(triple(first), triple(last), *away)

    def warnings(self) -> list[str]:
        """In words, which end is not where it was asked for."""
        return [
            f"the path {verb} at {point_text(place)}, {moved:.1f} mm from the {name} that was asked for: "
            "it is a smooth curve through the widest places near by"
            for name, verb, place, moved in (
                ("start", "begins", self.start, self.start_moved_mm),
                ("end", "ends", self.end, self.end_moved_mm),
            )
            if moved > MOVED_MM
        ]
