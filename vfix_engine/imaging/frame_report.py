"""Frame and unit of a file: named by the file, given by the user, or assumed as LPS mm and reported."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import FrameError
from vfix_engine.frames import RAS_TO_LPS

MM_PER_UNIT = {"mm": 1.0, "m": 1000.0}
FRAMES = ("LPS", "RAS")


@dataclass(frozen=True)
class FrameReport:
    """Frame and unit in which a file was read; the result of reading is LPS mm.

    name: the frame. assumed: whether frame or unit were assumed.
    missing: what neither file nor user names: 'frame', 'unit', both or nothing.
    unit: 'mm' or 'm'; unit_named: whether the file names it.
    notes: what its reader left out, resampled or chose between, in sentences.
    """

    name: str
    assumed: bool
    missing: tuple[str, ...] = ()
    unit: str = "mm"
    unit_named: bool = False
    notes: tuple[str, ...] = ()


def to_lps_mm(points: npt.ArrayLike, frame: str, unit: str) -> npt.NDArray[np.float64]:
    """Points (n, 3) of a frame and unit as LPS mm. Raises FrameError for an unknown frame or unit."""
    check_frame(frame)
    check_unit(unit)
    placed = np.asarray(points, dtype=np.float64) * MM_PER_UNIT[unit]
    return placed * RAS_TO_LPS if frame == "RAS" else placed


def resolve_frame(
    named: tuple[str | None, str | None], given: tuple[str | None, str | None], *, assume: bool
) -> tuple[str, str, FrameReport]:
    """Frame and unit of a file from what the file names and what the user gives; each pair is (frame, unit).

    Args:
        named, given: of the file and of the user; None where missing.
        assume: take LPS and mm for what neither names, and report it.

    Returns:
        Frame, unit and the report.

    Raises:
        FrameError: an unknown word, a contradiction between user and file, or a missing value without `assume`.
    """
    check_frame(given[0])
    check_unit(given[1])
    missing = []
    for word, in_file, from_user in zip(("frame", "unit"), named, given, strict=True):
        if in_file is None and from_user is None:
            missing.append(word)
        if in_file is not None and from_user is not None and in_file != from_user:
            raise FrameError(f"the file names the {word} {in_file}, not {from_user}.")
    if missing and not assume:
        choices = {"frame": "frame (LPS or RAS)", "unit": "unit (mm or m)"}
        raise FrameError(
            f"the file does not name its {' and its '.join(choices[word] for word in missing)}; say which.",
            tuple(missing),
        )
    frame, unit = named[0] or given[0] or "LPS", named[1] or given[1] or "mm"
    return frame, unit, FrameReport(frame, bool(missing), tuple(missing), unit, unit_named=named[1] is not None)


def check_frame(frame: str | None) -> None:
    """Raise FrameError unless the frame is None, LPS or RAS."""
    if frame is not None and frame not in FRAMES:
        raise FrameError(f"the frame {frame!r} is not known; say LPS or RAS.")


def check_unit(unit: str | None) -> None:
    """Raise FrameError unless the unit is None, mm or m."""
    if unit is not None and unit not in MM_PER_UNIT:
        raise FrameError(f"the unit {unit!r} is not known; say mm or m.")
