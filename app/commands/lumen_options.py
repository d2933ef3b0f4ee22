"""What the commands about a lumen share: places, surfaces, landmarks and the motion of the tissue."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

from app.cases.structures import encloses
from vfix_engine.arrays import Array
from vfix_engine.errors import FrameError, InputError, MeshError
from vfix_engine.files.mesh_files import read_mesh
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.json_text import parse_json
from vfix_engine.pathway.pathway import TissueMotion
from vfix_engine.pathway.tissue_motion import breathing, peristalsis, together

_ASSUMED = "the surface's file does not name its frame and unit; LPS and mm are assumed: say --frame and --unit"
_TO_THE_HEAD = (0.0, 0.0, 1.0)
_ENTRY_MM = 300.0  # over that way from the entrance the breathing comes in: the anus stays where it is
_LARGEST_FILE = 1 << 20  # [byte] of landmarks


def place(text: str) -> Array:
    """Three numbers with commas between them."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(math.isfinite(number) for number in numbers):
        raise argparse.ArgumentTypeError(f"{text!r:.60} is no place: write x,y,z in mm")
    return np.array(numbers)


def open_words(mesh: TriangleMesh) -> str:
    """What to warn of a surface with a border, or whose triangles do not agree on a side; '' for a closed one."""
    if encloses(mesh):
        return ""
    return (
        "the surface is open or turned in part: what lies behind it is judged by the triangles that are there; close it"
    )


def lumen_tissue(breathing_mm: float | None, peristalsis_share: float | None) -> TissueMotion | None:
    """The motion of the pathway; None for a static one."""
    motions: list[TissueMotion] = []
    if breathing_mm is not None:
        motions.append(breathing(_TO_THE_HEAD, breathing_mm, falloff_s=_ENTRY_MM))
    if peristalsis_share is not None:
        motions.append(peristalsis(peristalsis_share))
    return together(*motions) if motions else None


def lumen_surface(path: Path, frame: str | None, unit: str | None) -> tuple[TriangleMesh, str | None]:
    """Read a lumen's surface; in words, what had to be assumed. Raises MeshError, FrameError."""
    try:
        mesh, read = read_mesh(path, frame, unit, assume=True)
    except (MeshError, FrameError) as error:
        raise type(error)(f"{path.name}: {error}") from error
    return mesh, _ASSUMED if read.assumed else None


def read_landmarks(file: Path) -> dict[str, Array]:
    """Positions by name from JSON: an object `landmarks` with [x, y, z] or an object with `lps` per name.

    Raises:
        InputError: an unreadable or malformed file.
    """
    try:
        with file.open("rb") as stream:
            data = stream.read(_LARGEST_FILE + 1)
        content = parse_json(data) if len(data) <= _LARGEST_FILE else None
    except OSError as error:
        raise InputError(f"{file.name} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{file.name} is no JSON: {error}") from None
    marks = content.get("landmarks") if isinstance(content, dict) else None
    if not isinstance(marks, dict):
        raise InputError(f"{file.name} has no object 'landmarks'")
    return {name: _landmark(file, name, mark) for name, mark in marks.items()}


def _landmark(file: Path, name: str, mark: object) -> Array:
    numbers = mark.get("lps") if isinstance(mark, dict) else mark
    if not isinstance(numbers, list) or len(numbers) != 3 or not all(_is_finite(number) for number in numbers):
        raise InputError(f"{file.name}: the landmark {name!r:.60} is no place [x, y, z] in LPS mm")
    return np.array(numbers, dtype=np.float64)


def _is_finite(number: object) -> bool:
    return isinstance(number, int | float) and not isinstance(number, bool) and math.isfinite(number)
