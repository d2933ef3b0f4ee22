"""Frame and unit of a file: stated by the file, given by the user, or assumed as LPS mm and reported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import FrameError
from vfix_engine.frames import RAS_TO_LPS

MM_PER_UNIT = {"mm": 1.0, "m": 1000.0, "um": 1e-3}
FRAMES = ("LPS", "RAS")
_SCHEME = "UCUM"  # of a coded unit of Markups, such as ["mm", "UCUM", "millimeter"]
_LONG = {
    **dict.fromkeys(("millimeter", "millimetre"), "mm"),
    **dict.fromkeys(("meter", "metre"), "m"),
    **dict.fromkeys(("micrometer", "micrometre", "micron"), "um"),
}
_MICRO = str.maketrans("\u00b5\u03bc", "uu")  # the micro sign and the Greek letter


@dataclass(frozen=True)
class FrameReport:
    """Frame and unit in which a file was read; the result of reading is in LPS mm.

    name: the frame. assumed: whether frame or unit were assumed.
    missing: what neither file nor user states: 'frame', 'unit', both or nothing.
    unit: 'mm', 'm' or 'um'; unit_named: whether the file states it.
    notes: sentences on what its reader omitted, resampled or selected.
    modality, description: of a DICOM series, '' of other files; the description is text of the file, which may identify
    the patient (HAZ-33).
    """

    name: str
    assumed: bool
    missing: tuple[str, ...] = ()
    unit: str = "mm"
    unit_named: bool = False
    notes: tuple[str, ...] = ()
    modality: str = ""
    description: str = ""


def to_lps_mm(points: npt.ArrayLike, frame: str, unit: str) -> npt.NDArray[np.float64]:
    """Convert points (n, 3) of a frame and unit to LPS mm. Raises FrameError for an unknown frame or unit."""
    check_frame(frame)
    check_unit(unit)
    placed = np.asarray(points, dtype=np.float64) * MM_PER_UNIT[unit]
    return placed * RAS_TO_LPS if frame == "RAS" else placed


def resolve_frame(
    named: tuple[str | None, str | None], given: tuple[str | None, str | None], *, assume: bool
) -> tuple[str, str, FrameReport]:
    """Determine frame and unit from what the file states and what the user gives; each pair is (frame, unit).

    Args:
        named, given: of the file and of the user; None if missing.
        assume: assume LPS and mm if neither states them, and report it.

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
        choices = {"frame": "frame (LPS or RAS)", "unit": "unit (mm, m or um)"}
        raise FrameError(
            f"the file does not name its {' and its '.join(choices[word] for word in missing)}; say which.",
            tuple(missing),
        )
    frame, unit = named[0] or given[0] or "LPS", named[1] or given[1] or "mm"
    return frame, unit, FrameReport(frame, bool(missing), tuple(missing), unit, unit_named=named[1] is not None)


def named_unit_of(words: Sequence[object]) -> str:
    """Return 'mm', 'm' or 'um' from all statements of a file: one, one per axis, or code, scheme and meaning.

    Raises FrameError for another unit, or if the statements differ.
    """
    if len(words) == 3 and words[1] == _SCHEME:
        words = [words[0], words[2]]
    units = [_unit_of(word) for word in words]
    for unit, word in zip(units, words, strict=True):
        if unit not in MM_PER_UNIT:
            raise FrameError(f"the file's unit {str(word)!r:.20} is not known; it must be {', '.join(MM_PER_UNIT)}.")
    if len(set(units)) != 1:
        raise FrameError(f"the file's units are {', '.join(units)[:40] or 'none'}; they must be the same everywhere.")
    return units[0]


def _unit_of(word: object) -> str:
    """Unit that a word means; if unknown, the word itself, or '' if it is not text."""
    text = word.strip().translate(_MICRO) if isinstance(word, str) else ""
    return _LONG.get(text.lower().removesuffix("s"), text)


def check_frame(frame: str | None) -> None:
    """Raise FrameError unless the frame is None, LPS or RAS."""
    if frame is not None and frame not in FRAMES:
        raise FrameError(f"the frame {frame!r} is not known; say LPS or RAS.")


def check_unit(unit: str | None) -> None:
    """Raise FrameError unless the unit is None, mm, m or um."""
    if unit is not None and unit not in MM_PER_UNIT:
        raise FrameError(f"the unit {unit!r} is not known; say mm, m or um.")
