"""Parsing of text files: tables of separated values, JSON, and the frame and unit that they state."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from app.kit.errors import TooLarge
from app.kit.values import Position, check_position
from app.kit.values import number as checked_number
from vfix_engine.errors import FrameError, InputError, PlanError
from vfix_engine.files.frame_report import MM_PER_UNIT, named_unit_of
from vfix_engine.frames import RAS_TO_LPS
from vfix_engine.json_text import parse_json

MAX_TEXT = 16 << 20  # [byte] of a plan's file
UNIT_ASSUMED = "The file does not name its unit; mm was assumed."
_SEPARATORS = ",;\t"  # of the cells of a table
# Earlier versions of 3D Slicer wrote the numbers of its enumeration instead of names (HAZ-14).
_FRAMES = {"LPS": "LPS", "RAS": "RAS", "0": "RAS", "1": "LPS"}
_NUMBER = re.compile(r"\s*[-+]?\d*\.?\d+\.?(?:[eE][-+]?\d+)?\s*")
_TEXT_COLUMNS = frozenset(("kind", "label", "desc", "associatednodeid"))


def decode(data: bytes, what: str = "the file of the plan") -> str:
    """Decode the UTF-8 text of a file. what: the file, for messages. Raises PlanError or TooLarge."""
    if len(data) > MAX_TEXT:
        raise TooLarge(f"{what} has {len(data):,} bytes; {MAX_TEXT:,} are allowed.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise PlanError(f"{what} is not UTF-8 text; save it as that.") from None


def parse_json_object(text: str) -> dict[str, Any]:
    """Parse a JSON object without NaN and infinity. Raises PlanError or TooLarge."""
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


def known_frame(named: Any, stated: str | None) -> str:
    """Return the frame of a file, 'LPS' or 'RAS'.

    named: the frame named in the file. stated: the frame stated by the user.
    Raises FrameError if neither names one, if both do and differ, or for an unknown frame.
    """
    if stated is not None and stated not in ("LPS", "RAS"):
        raise FrameError(f"the frame {stated!r:.20} is not known; say LPS or RAS.")
    if named is None or named == "":
        if stated is None:
            raise FrameError("the file does not name its frame (LPS or RAS); say which.", ("frame",))
        return stated
    frame = _FRAMES.get(str(named))
    if frame is None:
        raise FrameError(f"the file's frame {str(named)!r:.20} is not known; it must be LPS or RAS.")
    if stated not in (None, frame):
        raise FrameError(f"the file names the frame {frame}, not {stated}.")
    return frame


def mm_per_unit(unit: Any) -> float:
    """Return the length in mm of a unit named in a file, or of a list of units, one for each axis.

    Raises FrameError for an unknown unit, and for a list whose units differ.
    """
    words = re.split(r"[\s,;]+", unit.strip()) if isinstance(unit, str) else unit
    return MM_PER_UNIT[named_unit_of(words if isinstance(words, list) else [words])]


def table_header(lines: Sequence[str], keys: Iterable[str], above: int) -> dict[str, str]:
    """Return the values of comment lines `# key=value` for these keys, ignoring their case; other lines are remarks.

    above: number of rows before the first point, such as the row of column names.
    Raises PlanError for a key with two different values, or below the first point.
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
    """Yield the rows below the row of column names, each with its line number.

    Cells have the same separator as the column names: a comma, a semicolon or a tab.
    Raises PlanError if one of the columns is missing or occurs twice, and for a row that is damaged or does not have
    one cell per column.
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
    """Raise PlanError for a row without one cell per column, whose values would be read as those of other columns.

    The message states whether the cause seems to be decimal commas or a comma in a label.
    """
    if len(cells) == len(columns):
        return
    found = f"it has {len(cells)} cells for {len(columns)} columns"
    if len(cells) < len(columns):
        raise PlanError(f"{found}: one is missing, or the row is cut off.")
    numbers = [cell for cell in cells if _NUMBER.fullmatch(cell)]
    of_numbers = sum(column.strip().lower() not in _TEXT_COLUMNS for column in columns)
    with_points = any("." in cell for cell in numbers)
    if separator == "," and not with_points and len(numbers) > of_numbers:
        raise PlanError(
            f"{found}, as where decimal commas begin new cells; write numbers with a point and not a comma."
        )
    if any(column.strip().lower() in _TEXT_COLUMNS for column in columns):
        sign = {",": "comma", ";": "semicolon"}.get(separator, "tab")
        raise PlanError(f"{found}, as where a {sign} in a label begins a new cell; put the label in quotes.")
    raise PlanError(f"{found}; take out what is too many.")


def cell_number(text: str) -> float:
    """Parse a number of a table's cell. Raises ValueError, also for text that only Python accepts, such as '1_0'."""
    if "_" in text or not text.isascii():
        raise ValueError("no number")
    return float(text)


def check_last_line(text: str) -> None:
    """Raise PlanError for a text cut off within a line, which may still be valid with a number that lost digits."""
    if text and not text.endswith(("\n", "\r")):
        raise PlanError(
            "the last line may be incomplete: it has no line break. "
            "If you know that the file is whole, add a line break at its end."
        )


def to_lps(position: Sequence[Any], frame: str, scale: float = 1.0) -> Position:
    """Convert a position of a file to LPS mm. scale: mm per unit of the file. Raises PlanError."""
    if len(position) > 3:
        raise PlanError(f"a position has {len(position)} numbers, not three; decimal commas have to be points.")
    signs = RAS_TO_LPS.tolist() if frame == "RAS" else (1.0, 1.0, 1.0)
    placed = check_position([checked_number(x, "a coordinate") * scale for x in position])
    # Adding 0.0 turns -0.0 into 0.0, which would otherwise be written differently and read as a change.
    return check_position([sign * x + 0.0 for sign, x in zip(signs, placed, strict=True)])


@contextmanager
def fault_at(where: str) -> Iterator[None]:
    """Prefix errors raised in this context with their location, such as a line or a control point."""
    try:
        yield
    except InputError as error:
        raise PlanError(f"{where}: {error}") from None
