"""Frame and unit of a file at the door: named, told by the user, or taken as LPS mm and said so."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import FrameError

MM_PER_UNIT = {"mm": 1.0, "m": 1000.0}
FRAMES = ("LPS", "RAS")
# RAS and LPS differ by half a turn about the axis to the head: the map is its own inverse.
RAS_TO_LPS = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class FrameReport:
    """Frame the file was written in, and whether that, or its unit, was assumed; what was read from it is LPS mm."""

    name: str
    assumed: bool


def to_lps_mm(points: npt.ArrayLike, frame: str, unit: str) -> npt.NDArray[np.float64]:
    """Points (n, 3) of a frame and unit as LPS mm. Raises FrameError for a frame or unit that is not known."""
    check_frame(frame)
    check_unit(unit)
    placed = np.asarray(points, dtype=np.float64) * MM_PER_UNIT[unit]
    return placed * RAS_TO_LPS if frame == "RAS" else placed


def check_frame(frame: str | None) -> None:
    """Raise FrameError unless the frame is None, LPS or RAS."""
    if frame is not None and frame not in FRAMES:
        raise FrameError(f"the frame {frame!r} is not known; say LPS or RAS.")


def check_unit(unit: str | None) -> None:
    """Raise FrameError unless the unit is None, mm or m."""
    if unit is not None and unit not in MM_PER_UNIT:
        raise FrameError(f"the unit {unit!r} is not known; say mm or m.")
