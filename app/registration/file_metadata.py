"""What the file of a transform says of its own making, which is shown as its words: nothing here has checked it.

Only that it was simulated counts: a file may make a transform less trusted, never more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from msgspec import Meta

from vfix_engine.errors import InputError
from vfix_engine.frames import RegisteredTo

MOST_MM, MOST_POINTS = 1e6, 1_000_000
SaidLength = Annotated[float, Meta(ge=0.0, le=MOST_MM)]
FULL: dict[RegisteredTo, str] = {"patient": "the patient", "base": "the robot's base"}
_WAYS = ("registration", "direction")  # keys whose value says which way it goes
_NOT_SIMULATED = ("", "no", "false", "none", "0")
_FIGURES = {"fre_mm": "fre_mm", "points": "points", "fle_mm": "error_of_a_point_mm"}  # by field, its key in a file


@dataclass(frozen=True)
class FileMetadata:
    """to: what the transform leads to, None where the file leaves that open. simulated: no patient was measured.

    fre_mm, points, fle_mm: FRE, number of points and error of one, as a `FitReport` has them; None where it says none.
    """

    to: RegisteredTo | None = None
    simulated: bool = False
    fre_mm: SaidLength | None = None
    points: Annotated[int, Meta(gt=0, le=MOST_POINTS)] | None = None
    fle_mm: SaidLength | None = None

    @property
    def words(self) -> str:
        """The figures in a sentence, as the file's; '' where it has none."""
        parts = [] if self.points is None else [f"{self.points} point{'' if self.points == 1 else 's'}"]
        parts += [] if self.fre_mm is None else [f"FRE {self.fre_mm:.2f} mm"]
        parts += [] if self.fle_mm is None else [f"error of one point {self.fle_mm:.2f} mm"]
        return f"Said by the file, and not checked here: {', '.join(parts)}." if parts else ""


def direction(to: RegisteredTo) -> str:
    """Which way a registration goes, as files of transforms say it."""
    return f"from the image (LPS, mm) to {FULL[to]} (mm)"


def said_of(lines: Sequence[tuple[str, Any]], to: RegisteredTo | None = None) -> FileMetadata:
    """What keys and values of a file say. to: what it says otherwise that the transform leads to.

    A figure that cannot be one is passed over. Raises InputError where the file names two frames.
    """
    known = {direction(frame): frame for frame in FULL}
    frames = {known[str(value)] for key, value in lines if key in _WAYS and str(value) in known}
    frames |= set() if to is None else {to}
    if len(frames) > 1:
        raise InputError("the file's transform leads to both the patient and the robot's base.")
    values = dict(lines)
    simulated = any(_says_yes(value) for key, value in lines if key == "simulated")
    figures = {name: _figure(values.get(key)) for name, key in _FIGURES.items() if name != "points"}
    count = _figure(values.get("points"))
    points = int(count) if count and count.is_integer() and count <= MOST_POINTS else None
    return FileMetadata(next(iter(frames), None), simulated, points=points, **figures)


def _says_yes(value: Any) -> bool:
    """Whatever does not say no."""
    return str(value).strip().lower() not in _NOT_SIMULATED


def _figure(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        found = float(value)
    except ValueError:
        return None
    return found if math.isfinite(found) and 0.0 <= found <= MOST_MM else None
