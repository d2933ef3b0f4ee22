"""The dense curve of a path, for exports."""

from __future__ import annotations

from dataclasses import dataclass

from app.kit.values import Position


@dataclass(frozen=True)
class CurveSample:
    """A place of the path as driven: arc length s, and the clearance of the whole tool there, all in mm.

    clearance_mm is None where the tool did not get.
    """

    s_mm: float
    position: Position
    clearance_mm: float | None
