"""Tables that name the labels of a map: JSON, CSV or TSV, and the label table in a NIfTI file's extension.

TotalSegmentator writes the latter into its multi-label files: the XML of Connectome Workbench, with a name and a
colour for each label.
"""

from __future__ import annotations

import csv
import io
import re
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError, XMLParser

from vfix_engine.anatomy.labels.label_map import MAX_VALUE, LabelLook
from vfix_engine.errors import ImageError
from vfix_engine.files.text_bytes import text_of_bytes
from vfix_engine.json_text import parse_json

NAMES_SUFFIXES = (".json", ".csv", ".tsv")
MAX_TABLE_BYTES = 1 << 20
_VALUE_WORDS = ("label", "value", "index", "id", "key", "labelvalue", "label_value", "number")
_NAME_WORDS = ("name", "structure", "label_name", "class", "text", "region", "label")

_XML_ENCODING = re.compile(rb"<\?xml[^>]*encoding=[\"']([A-Za-z0-9._-]+)")

Looks = dict[int, LabelLook]


def read_names(path: Path) -> Looks:
    """Read names by label from a table. Raises ImageError if it has none."""
    data = path.read_bytes()
    if len(data) > MAX_TABLE_BYTES:
        raise ImageError(f"the table of names is larger than {MAX_TABLE_BYTES >> 20} MiB.")
    text = text_of_bytes(data)
    names = _from_json(text) if path.suffix.lower() == ".json" else _from_table(text)
    if not names:
        raise ImageError(
            "the table of names holds none: it needs a number and a name for each label, as JSON "
            '({"1": "spleen"}) or as a CSV or TSV with the columns label and name.'
        )
    return names


def _from_json(text: str) -> Looks:
    """Parse {"1": name}, {name: 1}, a list of objects, or one of these below 'labels', as nnU-Net writes it."""
    try:
        data: Any = parse_json(text)
    except ValueError as error:
        raise ImageError(f"the table of names is not valid JSON: {error}.") from None
    for key in ("labels", "names"):
        if isinstance(data, Mapping) and isinstance(data.get(key), Mapping | list):
            data = data[key]
    pairs: list[tuple[Any, Any]] = []
    if isinstance(data, Mapping):
        pairs = [(key, value) if isinstance(value, str) else (value, key) for key, value in data.items()]
    elif isinstance(data, list):
        rows = [{str(key).lower(): value for key, value in row.items()} for row in data if isinstance(row, Mapping)]
        pairs = [(_first(row, _VALUE_WORDS), _first(row, _NAME_WORDS)) for row in rows]
    return _looks(pairs)


def _from_table(text: str) -> Looks:
    """Parse columns by their headers if there are any, else number and name in either order."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        return {}
    separator = max("\t;,", key=lines[0].count)
    rows = [[cell.strip() for cell in row] for row in csv.reader(io.StringIO("\n".join(lines)), delimiter=separator)]
    head = [cell.lower() for cell in rows[0]]
    headed = not any(_number(cell) is not None for cell in head)
    if any(len(row) > len(head) or (not headed and len(row) != len(head)) for row in rows):
        raise ImageError(
            "a row of the table of names does not have a cell for each column; put a name with a comma in quotes."
        )
    if headed:
        entries = [dict(zip(head, row, strict=False)) for row in rows[1:]]
        return _looks([(_first(entry, _VALUE_WORDS), _first(entry, _NAME_WORDS)) for entry in entries])
    pairs = [(row[0], row[1]) for row in rows if len(row) > 1]
    return _looks([pair if _number(pair[0]) is not None else pair[::-1] for pair in pairs])


def _first(row: Mapping[str, Any], words: tuple[str, ...]) -> Any:
    """Return the first of these columns that exists: a number if a number is requested, else text."""
    numbers = words is _VALUE_WORDS
    cells = [row[word] for word in words if word in row]
    return next((cell for cell in cells if (_number(cell) is not None) == numbers), None)


def _looks(pairs: list[tuple[Any, Any]]) -> Looks:
    """Collect pairs of number and name. Raises ImageError for a label with two names."""
    looks: Looks = {}
    for value, name in pairs:
        number = _number(value)
        if number is None or number == 0 or not isinstance(name, str) or not name.strip():
            continue
        if looks.get(number, LabelLook(name.strip())).name != name.strip():
            raise ImageError(f"the table of names gives label {number} two names; keep one.")
        looks[number] = LabelLook(name.strip())
    return looks


def _number(value: Any) -> int | None:
    if isinstance(value, bool) or not isinstance(value, int | str) or not re.fullmatch(r"\d{1,9}", str(value).strip()):
        return None
    return int(value) if int(value) <= MAX_VALUE else None


def names_in_nifti(head: bytes) -> Looks:
    """Read names and colours from the label table in a NIfTI header's extensions; empty if there is no such table.

    head: the file's bytes, uncompressed, up to its voxels. Extensions as in nifti1.h: from byte 352, each with its size
    and code as 32-bit integers and its content.
    """
    if len(head) < 352 or not head[348]:
        return {}
    order = "<" if struct.unpack_from("<i", head)[0] == 348 else ">"
    at = 352
    while at + 8 <= len(head):
        (size,) = struct.unpack_from(order + "i", head, at)
        if size < 16 or at + size > min(len(head), 352 + MAX_TABLE_BYTES):
            break
        content = head[at + 8 : at + size].rstrip(b"\0 \r\n\t")
        if b"<LabelTable" in content:
            return _from_xml(content)
        at += size
    return {}


class _Table:
    """Target of an XML parser that collects the `Label` elements; entities cannot be declared in the document."""

    def __init__(self) -> None:
        self.looks: Looks = {}
        self._open: tuple[int, str | None] | None = None
        self._text = ""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "Label":
            number = _number(attributes.get("Key", ""))
            self._open, self._text = (None if number is None else (number, _colour_of(attributes))), ""

    def data(self, text: str) -> None:
        self._text += text

    def end(self, tag: str) -> None:
        if tag == "Label" and self._open is not None and self._open[0] > 0:
            self.looks[self._open[0]] = LabelLook(self._text.strip(), self._open[1])
        if tag == "Label":
            self._open = None

    def close(self) -> None:
        """Called by the parser at the end of the document."""


def _from_xml(content: bytes) -> Looks:
    """Parse the table. Raises ImageError if it is damaged, since wrong names are worse than none."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise ImageError("the label table in the NIfTI header declares entities, which is not read.")
    table = _Table()
    parser = XMLParser(target=table)
    try:
        declared = _XML_ENCODING.match(content)
        parser.feed(text_of_bytes(content, [declared[1].decode("ascii")] if declared else ()))
        parser.close()
    except (ParseError, ValueError):
        raise ImageError("the label table in the NIfTI header is damaged; export the segmentation again.") from None
    return table.looks


def _colour_of(attributes: Mapping[str, str]) -> str | None:
    """'#rrggbb' of Red, Green and Blue from 0 to 1."""
    try:
        return hex_colour([float(attributes[word]) for word in ("Red", "Green", "Blue")])
    except (KeyError, ValueError):
        return None


def hex_colour(parts: list[float]) -> str | None:
    """'#rrggbb' of three numbers from 0 to 1; None for anything else."""
    if len(parts) != 3 or not all(0.0 <= part <= 1.0 for part in parts):
        return None
    return "#" + "".join(f"{round(255 * part):02x}" for part in parts)
