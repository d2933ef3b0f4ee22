"""What the exchange formats share: careful JSON, frames and units at the door, and the dense curve."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from app.services.errors import TooLarge
from app.services.names import check_label
from app.services.plan_model import PlanPoint, Position, check_position, new_point_id
from app.services.plan_model import number as checked_number
from vfix_engine.errors import FrameError, InputError, PlanError
from vfix_engine.frames import RAS_TO_LPS
from vfix_engine.imaging.frame_report import MM_PER_UNIT, named_unit_of
from vfix_engine.json_text import parse_json

MAX_TEXT = 16 << 20  # [byte] of a plan's file
UNIT_ASSUMED = "The file does not name its unit; mm was assumed."
_SEPARATORS = ",;\t"  # of a table's cells
# 3D Slicer wrote its enumeration before it wrote the names (HAZ-14).
_FRAMES = {"LPS": "LPS", "RAS": "RAS", "0": "RAS", "1": "LPS"}
_NUMBER = re.compile(r"\s*[-+]?\d*\.?\d+\.?(?:[eE][-+]?\d+)?\s*")
_TEXT_COLUMNS = frozenset(("kind", "label", "desc", "associatednodeid"))


@dataclass(frozen=True)
class CurveSample:
    """A place of the path as driven: arc length s, and the clearance of the whole tool there, all in mm.

    clearance_mm is None where the tool did not get.
    """

    s_mm: float
    position: Position
    clearance_mm: float | None


def decode(data: bytes, what: str = "the file of the plan") -> str:
    """UTF-8 text of a file; what: it is, for the message. Raises PlanError or TooLarge."""
    if len(data) > MAX_TEXT:
        raise TooLarge(f"{what} has {len(data):,} bytes; {MAX_TEXT:,} are allowed.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise PlanError(f"{what} is not UTF-8 text; save it as that.") from None


def parse_json_object(text: str) -> dict[str, Any]:
    """A JSON object without NaN and infinity. Raises PlanError or TooLarge."""
    if len(text) > MAX_TEXT:
        raise TooLarge(f"the plan's JSON has {len(text):,} characters; {MAX_TEXT:,} are allowed.")
    try:
        data = parse_json(text)
    except ValueError as error:
        raise PlanError(f"the file is not sound JSON: {error}.") from None
    if not isinstance(data, dict):
        raise PlanError("the file must hold one JSON object.")
    return data


def to_json_text(data: dict[str, Any]) -> str:
    return json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def known_frame(named: Any, given: str | None) -> str:
    """Frame of a file, out of what it names and what the user says.

    Raises FrameError when nobody names one, when both do and differ, or for an unknown word.
    """
    if given is not None and given not in ("LPS", "RAS"):
        raise FrameError(f"the frame {given!r:.20} is not known; say LPS or RAS.")
    if named is None or named == "":
        if given is None:
            raise FrameError("the file does not name its frame (LPS or RAS); say which.", ("frame",))
        return given
    frame = _FRAMES.get(str(named))
    if frame is None:
        raise FrameError(f"the file's frame {str(named)!r:.20} is not known; it must be LPS or RAS.")
    if given not in (None, frame):
        raise FrameError(f"the file names the frame {frame}, not {given}.")
    return frame


def mm_per_unit(unit: Any) -> float:
    """Millimetres per unit of a file that names one, or a list of them, one for each axis.

    Raises FrameError for an unknown word, and for a list whose units differ.
    """
    words = re.split(r"[\s,;]+", unit.strip()) if isinstance(unit, str) else unit
    return MM_PER_UNIT[named_unit_of(words if isinstance(words, list) else [words])]


def table_header(lines: Sequence[str], keys: Iterable[str], above: int) -> dict[str, str]:
    """What the comment lines `# key=value` say under these keys, whose case does not matter; others are remarks.

    above: how many rows come before the first point, such as that of the columns' names.
    Raises PlanError for a key that is given twice with different values, or below the first point.
    """
    known, rows = {key.lower(): key for key in keys}, 0
    header: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        if not line.startswith("#"):
            rows += bool(line.strip())
            continue
        word, separator, value = (part.strip() for part in line[1:].partition("="))
        if not separator or word.lower() not in known:
            continue
        key, where = known[word.lower()], f"line {number}: '{word}={value:.40}' stands"
        if rows > above:
            raise PlanError(f"{where} below the first point; say it above, once for all points, or split the file.")
        if header.setdefault(key, value) != value:
            raise PlanError(f"{where} after {key}={header[key]:.40}; keep the one that is right, or split the file.")
    return header


def table_rows(lines: Sequence[str], columns: Iterable[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """The rows below the one that names the columns, each with the number of its line, one after the other.

    Cells are separated by what separates the names of the columns: a comma, a semicolon or a tab.
    Raises PlanError where that row lacks one of these columns or has one twice, and for a row that is damaged or does
    not have a cell for each column.
    """
    kept = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    separator = max(_SEPARATORS, key=kept[0][1].count) if kept else ","
    reader = csv.reader((line for _, line in kept), delimiter=separator, strict=True)
    try:
        names = next(reader, [])
        counts = Counter(names)
        if kept and not counts.keys() >= set(columns):
            raise PlanError(f"the table's first row names its columns: {','.join(columns)}.")
        for name, count in counts.items():
            if name and count > 1:
                raise PlanError(f"two columns of the table are called {name!r:.40}; delete one of them.")
        for cells in reader:
            number = kept[reader.line_num - 1][0]
            with fault_at(f"line {number} of the table"):
                check_cells(cells, names, separator)
            yield number, dict(zip(names, cells, strict=True))
    except csv.Error as error:
        raise PlanError(f"line {kept[reader.line_num - 1][0]} of the table is damaged: {error}.") from None


def check_cells(cells: Sequence[str], columns: Sequence[str], separator: str = ",") -> None:
    """Refuse a row that does not have a cell for each column: its values would be taken for those of others.

    Raises PlanError, which says whether it looks like decimal commas or like a comma in a label.
    """
    if len(cells) == len(columns):
        return
    told = f"it has {len(cells)} cells for {len(columns)} columns"
    if len(cells) < len(columns):
        raise PlanError(f"{told}: one is missing, or the row is cut off.")
    numbers = [cell for cell in cells if _NUMBER.fullmatch(cell)]
    of_numbers = sum(column.strip().lower() not in _TEXT_COLUMNS for column in columns)
    with_points = any("." in cell for cell in numbers)
    if separator == "," and not with_points and len(numbers) > of_numbers:
        raise PlanError(f"{told}, as where decimal commas begin new cells; write numbers with a point and not a comma.")
    if any(column.strip().lower() in _TEXT_COLUMNS for column in columns):
        sign = {",": "comma", ";": "semicolon"}.get(separator, "tab")
        raise PlanError(f"{told}, as where a {sign} in a label begins a new cell; put the label in quotes.")
    raise PlanError(f"{told}; take out what is too many.")


def cell_number(text: str) -> float:
    """A number out of a table's cell. Raises ValueError for what Python alone takes for one, such as '1_0'."""
    if "_" in text or not text.isascii():
        raise ValueError("no number")
    return float(text)


def check_last_line(text: str) -> None:
    """Refuse a text that is cut off within a line, which may still make sense: its last number has lost digits."""
    if text and not text.endswith(("\n", "\r")):
        raise PlanError(
            "the last line of the file does not end in a line break, so that its last value may be incomplete. "
            "If you know that the file is whole, add a line break at its end."
        )


def to_lps(position: Sequence[Any], frame: str, scale: float = 1.0) -> Position:
    """A position of a file as LPS mm; scale: millimetres per unit of the file. Raises PlanError."""
    if len(position) > 3:
        raise PlanError(f"a position has {len(position)} numbers, not three; decimal commas have to be points.")
    signs = RAS_TO_LPS.tolist() if frame == "RAS" else (1.0, 1.0, 1.0)
    placed = check_position([checked_number(x, "a coordinate") * scale for x in position])
    # A zero stays a zero: -0.0 would be written differently and read as a change.
    return check_position([sign * x + 0.0 for sign, x in zip(signs, placed, strict=True)])


@contextmanager
def fault_at(where: str) -> Iterator[None]:
    """An error in there says where it is: a line, a control point."""
    try:
        yield
    except InputError as error:
        raise PlanError(f"{where}: {error}") from None


def new_point(label: Any, position: Position) -> PlanPoint:
    """A point that enters the plan from outside."""
    return PlanPoint(new_point_id(), check_label("" if label is None else label, "label"), position)
