"""Surfaces in PLY, as text and binary in either byte order: vertices and polygons of any size.

http://paulbourke.net/dataformats/ply/. Other elements and properties are skipped. The counts of the header are
compared with the content before memory is allocated for them.
"""

from __future__ import annotations

import re
import struct
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import MeshError
from vfix_engine.files.mesh_parts import (
    MeshArrays,
    check_count,
    check_last_line,
    fans,
    fault_of,
    number_of,
    rows_of,
    without_mark,
)

_TYPES = {
    **dict.fromkeys((b"char", b"int8"), "b"), **dict.fromkeys((b"uchar", b"uint8"), "B"),
    **dict.fromkeys((b"short", b"int16"), "h"), **dict.fromkeys((b"ushort", b"uint16"), "H"),
    **dict.fromkeys((b"int", b"int32"), "i"), **dict.fromkeys((b"uint", b"uint32"), "I"),
    b"int64": "q", b"uint64": "Q",
    **dict.fromkeys((b"float", b"float32"), "f"), **dict.fromkeys((b"double", b"float64"), "d"),
}  # fmt: skip
_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
_CORNERS = (b"vertex_indices", b"vertex_index")
_HEADER = re.compile(rb"ply[ \t]*(\r\n|\n|\r)(.*?(?:\r\n|\n|\r))end_header[ \t]*", re.DOTALL)
_HEADER_BYTES = 1 << 16


@dataclass(frozen=True)
class _Property:
    """length: type of a list's length, '' for a single value. kind: type of the value, or of the list's elements."""

    name: bytes
    length: str
    kind: str


@dataclass
class _Element:
    name: bytes
    count: int
    properties: list[_Property] = field(default_factory=list)

    def at(self, *names: bytes) -> int | None:
        """Index of the first property with one of these names."""
        return next((n for n, one in enumerate(self.properties) if one.name in names), None)

    @property
    def least_bytes(self) -> int:
        """Smallest size of all items: a list has at least its own length."""
        return self.count * sum(struct.calcsize("=" + (one.length or one.kind)) for one in self.properties)


# For each item a value, or a list of values, per property; or all as a structured array with the fields v0, v1, …
PlyRows = Iterator[list[Any]] | npt.NDArray[Any]


def read_ply(data: bytes) -> MeshArrays:
    """Read vertices (n, 3) in the file's units and triangles (m, 3). Raises MeshError."""
    data = without_mark(data, "PLY")
    head = _HEADER.match(data[:_HEADER_BYTES])
    if head is None or not data.startswith(head[1], head.end()):
        raise MeshError("the file is not PLY, or its header is cut off.")
    body, lines = data[head.end() + len(head[1]) :], [line.split() for line in head[2].splitlines()]
    order = next((_ORDERS.get(line[1]) for line in lines if line[:1] == [b"format"] and len(line) == 3), None)
    if order is None:
        raise MeshError("the PLY header names no format that is read: ascii or binary, version 1.0.")
    elements = _elements(lines)
    counts = {one.name: one.count for one in elements}
    if not counts.get(b"face") and counts.get(b"tristrips"):
        raise MeshError("the PLY file holds triangle strips, which are not read; save it with triangles.")
    if not counts.get(b"vertex") or not counts.get(b"face"):
        raise MeshError("the PLY file holds no triangles.")
    return _of_text(body, elements) if order == "" else _of_bytes(body, elements, order)


def _elements(lines: list[list[bytes]]) -> list[_Element]:
    elements: list[_Element] = []
    for line in lines:
        if line[:1] == [b"element"]:
            if len(line) != 3 or not line[2].isdigit() or len(line[2]) > 11:
                raise MeshError("the PLY header has an element without a count.")
            elements.append(_Element(line[1], int(line[2])))
        elif line[:1] == [b"property"]:
            listed = line[1:2] == [b"list"]
            kinds = [_TYPES.get(word, "") for word in line[1 + listed : -1]]
            if not elements or len(kinds) != 1 + listed or "" in kinds or (listed and kinds[0] in "fd"):
                raise MeshError("the PLY header names a type that is not known, or a property of no element.")
            elements[-1].properties.append(_Property(line[-1], kinds[0] if listed else "", kinds[-1]))
    for one in elements:
        if not one.properties:
            raise MeshError("the PLY header has an element without properties.")
    return elements


def _surface(parts: Iterable[tuple[_Element, PlyRows]]) -> MeshArrays:
    vertices, faces = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    for element, rows in parts:
        if element.name == b"vertex":
            vertices = _corners(element, rows)
        elif element.name == b"face":
            faces = _triangles(element, rows)
        elif not isinstance(rows, np.ndarray):
            deque(rows, maxlen=0)  # skips them
    return vertices, faces


def _corners(element: _Element, rows: PlyRows) -> npt.NDArray[np.float64]:
    at = [n for name in (b"x", b"y", b"z") if (n := element.at(name)) is not None and not element.properties[n].length]
    if len(at) != 3:
        raise MeshError("the corners of the PLY file have no x, y and z.")
    if isinstance(rows, np.ndarray):
        return np.stack([rows[f"v{n}"] for n in at], axis=1).astype(np.float64)
    return np.array([[row[n] for n in at] for row in rows], dtype=np.float64)


def _triangles(element: _Element, rows: PlyRows) -> npt.NDArray[np.int64]:
    check_count(element.count)
    at = element.at(*_CORNERS)
    if at is None or not element.properties[at].length or element.properties[at].kind in "fd":
        raise MeshError("the polygons of the PLY file have no list 'vertex_indices' of whole numbers.")
    if isinstance(rows, np.ndarray):
        lists = rows[f"v{at}"]
        return fans(np.full(len(lists), lists.shape[1]), lists.ravel(), "PLY")
    named = [row[at] for row in rows]
    try:
        corners = np.fromiter(chain.from_iterable(named), np.int64)
    except OverflowError:
        raise MeshError("a polygon of the PLY file names a corner that cannot be; it is damaged.") from None
    return fans([len(one) for one in named], corners, "PLY")


# -- text


def _of_text(body: bytes, elements: list[_Element]) -> MeshArrays:
    """Parse a text PLY, which has one row per item with as many values as its properties have."""
    claimed, there = sum(one.count for one in elements), sum(1 for _ in rows_of(body))
    if there != claimed:
        why = "the file is cut off or damaged" if there < claimed else f"{there - claimed:,} are too many"
        raise MeshError(f"the PLY header claims {claimed:,} rows of values, but {there:,} are there; {why}.")
    check_last_line(body, "PLY")
    rows = rows_of(body)
    return _surface((one, _text_rows(one, islice(rows, one.count))) for one in elements)


def _text_rows(element: _Element, rows: Iterator[tuple[int, list[bytes]]]) -> Iterator[list[Any]]:
    kept = element.name in (b"vertex", b"face")
    for number, words in rows:
        values: list[Any] = []
        taken = 0
        for one in element.properties:
            count = 1
            if one.length:
                count = _length(words[taken]) if taken < len(words) else 0
                taken += 1
            part, taken = words[taken : taken + count], taken + count
            values.append(part if one.length else part[:1])
        if taken != len(words):
            why = fault_of(words)
            raise MeshError(f"row {number:,} of the PLY file has {len(words)} values, not {taken}; {why}.")
        try:
            yield [_read(part, one) for part, one in zip(values, element.properties, strict=True)] if kept else []
        except ValueError:
            raise MeshError(f"row {number:,} of the PLY file is not of numbers: {fault_of(words)}.") from None


def _length(word: bytes) -> int:
    return int(word) if word.isdigit() and len(word) < 6 else 0


def _read(words: list[bytes], one: _Property) -> Any:
    if one.name in _CORNERS:
        return [int(word) if word.lstrip(b"+-").isdigit() and len(word) < 19 else int(b"") for word in words]
    return None if one.length else number_of(words[0])


# -- binary


def _of_bytes(body: bytes, elements: list[_Element], order: str) -> MeshArrays:
    needed = sum(one.least_bytes for one in elements)
    if needed > len(body):
        raise MeshError(
            f"the PLY file is cut off: its header claims at least {needed:,} bytes, {len(body):,} are there."
        )
    reader = _Bytes(body, order)
    arrays = _surface((one, reader.rows(one)) for one in elements)
    if reader.at != len(body):
        raise MeshError(
            f"the PLY file holds {len(body) - reader.at:,} bytes more than its header claims; it is damaged, or "
            "another program has added to it: save it again."
        )
    return arrays


class _Bytes:
    def __init__(self, body: bytes, order: str) -> None:
        self._body, self._order, self.at = body, order, 0

    def rows(self, element: _Element) -> PlyRows:
        """Return a structured array if all items have the same layout, which is usual, else items one by one."""
        if (dtype := self._alike(element)) is not None:
            size = element.count * dtype.itemsize
            if self.at + size <= len(self._body):
                found = np.frombuffer(self._body, dtype, element.count, self.at)
                lists = [f"n{n}" for n, one in enumerate(element.properties) if one.length]
                if all((found[name] == found[name][0]).all() for name in lists):
                    self.at += size
                    return found
        return self._one_by_one(element)

    def _alike(self, element: _Element) -> np.dtype[Any] | None:
        """Return the type of every item, if all have the layout of the first one."""
        if not element.count:
            return None
        at = self.at
        parts: list[tuple[str, np.dtype[Any], tuple[int, ...]]] = []
        for n, one in enumerate(element.properties):
            shape: tuple[int, ...] = ()
            if one.length:
                shape = self._values(one.length, at, 1)
                if not 0 <= shape[0] < 1 << 16:
                    return None
                parts.append((f"n{n}", np.dtype(self._order + one.length), ()))
                at += struct.calcsize("=" + one.length)
            parts.append((f"v{n}", np.dtype(self._order + one.kind), shape))
            at += struct.calcsize("=" + one.kind) * (shape[0] if shape else 1)
        return np.dtype(parts)

    def _one_by_one(self, element: _Element) -> Iterator[list[Any]]:
        for _ in range(element.count):
            values: list[Any] = []
            for one in element.properties:
                count = 1
                if one.length:
                    count = self._values(one.length, self.at, 1)[0]
                    self.at += struct.calcsize("=" + one.length)
                found = self._values(one.kind, self.at, count)
                self.at += struct.calcsize("=" + one.kind) * count
                values.append(found if one.length else found[0])
            yield values

    def _values(self, kind: str, at: int, count: int) -> tuple[Any, ...]:
        if count < 0:
            raise MeshError("a list in the PLY file has a negative length; it is damaged.")
        if at + struct.calcsize("=" + kind) * count > len(self._body):
            raise MeshError("the PLY file is cut off: its lists take more bytes than are there.")
        return struct.unpack_from(f"{self._order}{count}{kind}", self._body, at)
