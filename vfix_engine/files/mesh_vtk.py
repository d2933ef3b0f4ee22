"""Surfaces of VTK: legacy `.vtk` and XML `.vtp`, polygons only (VTK file formats, versions 2.0 to 5.1 and 0.1 to 2.2).

3D Slicer states the frame in the title of a `.vtk` or in a field 'SPACE'.
"""

from __future__ import annotations

import base64
import binascii
import re
import zlib
from typing import Any
from xml.etree.ElementTree import Element, ParseError, fromstring

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import MeshError
from vfix_engine.files.mesh_parts import check_last_line, fans, fault_of, without_mark

MAX_INFLATED = 1 << 30  # [byte] of one array
_LEGACY = re.compile(
    rb"# vtk DataFile Version \d+\.\d[^\n]*\n([^\n]*)\n\s*(ASCII|BINARY)\s*\nDATASET\s+(\w+)[ \t\r]*\n", re.IGNORECASE
)
_LEGACY_TYPES = {
    b"float": ">f4", b"double": ">f8", b"char": ">i1", b"signed_char": ">i1", b"unsigned_char": ">u1",
    b"short": ">i2", b"unsigned_short": ">u2", b"int": ">i4", b"unsigned_int": ">u4", b"long": ">i8",
    b"unsigned_long": ">u8", b"vtkidtype": ">i4", b"vtktypeint8": ">i1", b"vtktypeuint8": ">u1", b"vtktypeint16": ">i2",
    b"vtktypeuint16": ">u2", b"vtktypeint32": ">i4", b"vtktypeuint32": ">u4", b"vtktypeint64": ">i8",
    b"vtktypeuint64": ">u8",
}  # fmt: skip
_STRINGS = (b"string", b"utf8_string")
_SECTIONS = (b"points", b"polygons", b"vertices", b"lines", b"triangle_strips", b"field", b"point_data", b"cell_data")
_XML_TYPES = {
    "Float32": "f4", "Float64": "f8", "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4",
    "UInt32": "u4", "Int64": "i8", "UInt64": "u8",
}  # fmt: skip
_APPENDED = re.compile(rb"<AppendedData\s+encoding\s*=\s*\"(raw|base64)\"\s*>\s*_", re.DOTALL)


# -- legacy


def read_vtk(data: bytes) -> tuple[npt.NDArray[Any], npt.NDArray[Any], str | None]:
    """Read vertices (n, 3), triangles (m, 3) and the frame in a field 'SPACE'; polygons are triangulated.

    Raises MeshError.
    """
    data = without_mark(data, "VTK")
    head = _LEGACY.match(data)
    if head is None or head[3].upper() != b"POLYDATA":
        raise MeshError("the VTK file is not a surface: its header does not say DATASET POLYDATA.")
    reader = _Legacy(data, head.end(), binary=head[2].upper() == b"BINARY")
    points: npt.NDArray[Any] | None = None
    faces: npt.NDArray[Any] | None = None
    space: str | None = None
    while (words := reader.line()) and words[0].lower() not in (b"point_data", b"cell_data"):
        match words[0].lower():
            case b"points":
                points = reader.values(3 * reader.whole(words, 1), reader.word(words, 2)).reshape(-1, 3)
            case b"polygons":
                faces = fans(*reader.cells(words), "VTK")
            case b"vertices" | b"lines":
                reader.cells(words)
            case b"metadata":
                reader.skip_metadata()
            case b"field":
                space = reader.field(words) or space
            case b"triangle_strips":
                raise MeshError("the VTK file holds triangle strips, which are not read; save it with polygons.")
            case other:
                name = other[:20].decode("ascii", "replace")
                raise MeshError(f"the VTK file has a section {name!r}, which is not known; save it as polygons only.")
    if points is None or faces is None:
        raise MeshError("the VTK file holds no polygons, or is cut off.")
    return points.astype(np.float64), faces, space


class _Legacy:
    """Reads lines and arrays one after another."""

    def __init__(self, data: bytes, at: int, *, binary: bool) -> None:
        self._data, self._at, self._binary = data, at, binary

    def line(self) -> list[bytes]:
        """The words of the next line that is not empty; none at the end."""
        while self._at < len(self._data):
            if words := self._raw_line().split():
                return words
        return []

    def _raw_line(self) -> bytes:
        end = self._data.find(b"\n", self._at)
        end = len(self._data) if end < 0 else end
        line, self._at = self._data[self._at : end], end + 1
        return line

    def word(self, words: list[bytes], number: int) -> bytes:
        if len(words) <= number:
            raise MeshError("a line of the VTK file has too few words; it is damaged.")
        return words[number]

    def whole(self, words: list[bytes], number: int) -> int:
        word = self.word(words, number)
        if not word.isdigit() or len(word) > 10:
            raise MeshError("a count in the VTK file is not a whole number; it is damaged.")
        return int(word)

    def values(self, count: int, kind: bytes) -> npt.NDArray[Any]:
        """Read that many numbers from the present position."""
        code = _LEGACY_TYPES.get(kind.lower())
        if code is None:
            name = kind[:20].decode("ascii", "replace")
            raise MeshError(f"the VTK file holds numbers of a type that is not read, {name!r}; save it without them.")
        if self._binary:
            size = count * np.dtype(code).itemsize
            if self._at + size > len(self._data):
                raise MeshError("the VTK file is cut off: it claims more values than it has.")
            found = np.frombuffer(self._data, code, count, self._at)
            self._at += size
            return found
        return self._text(count, np.dtype(code).newbyteorder("="))

    def _text(self, count: int, kind: np.dtype[Any]) -> npt.NDArray[Any]:
        found: list[bytes] = []
        while len(found) < count:
            words = self.line()
            if not words:
                raise MeshError("the VTK file is cut off: it claims more values than it has.")
            found += words
        if len(found) > count:
            raise MeshError(f"the VTK file has more values than it claims: {fault_of(found)}.")
        if self._at > len(self._data):
            check_last_line(self._data, "VTK")
        try:
            if any(b"_" in word for word in found):  # which Python accepts within a number
                raise ValueError
            return np.array(found).astype(np.float64 if kind.kind == "f" else np.int64).astype(kind)
        except (ValueError, OverflowError):
            raise MeshError(f"a value of the VTK file is not a number: {fault_of(found)}.") from None

    def cells(self, words: list[bytes]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Sizes and vertices of polygons, lines or points.

        In the file they are alternating sizes and vertices, or offsets and vertices since version 5.1.
        """
        first, second = self.whole(words, 1), self.whole(words, 2)
        before = self._at
        kinds = self.line()
        if [word.lower() for word in kinds[:1]] != [b"offsets"]:
            self._at = before
            return _counted(self.values(second, b"int").astype(np.int64), first)
        offsets = self.values(first, self.word(kinds, 1)).astype(np.int64)
        kinds = self._past_metadata()
        corners = self.values(second, self.word(kinds, 1)).astype(np.int64)
        if first == 0:  # there are no cells
            return offsets, corners
        return _sizes(offsets, corners, "VTK"), corners

    def _past_metadata(self) -> list[bytes]:
        """Return the next line that is not part of a metadata block."""
        words = self.line()
        while [word.lower() for word in words[:1]] == [b"metadata"]:
            self.skip_metadata()
            words = self.line()
        return words

    def skip_metadata(self) -> None:
        """Skip a metadata block, which ends at an empty line, or at the next section if a program has omitted that."""
        while self._at < len(self._data):
            before = self._at
            words = self._raw_line().split()
            if not words:
                return
            if words[0].lower() in _SECTIONS:
                self._at = before
                return

    def field(self, words: list[bytes]) -> str | None:
        """Skip the arrays of a field; return the frame in the one called 'SPACE'."""
        space = None
        for _ in range(self.whole(words, 2)):
            array = self._past_metadata()
            count, kind = self.whole(array, 1) * self.whole(array, 2), self.word(array, 3).lower()
            if kind in _STRINGS:
                texts = [self._string() for _ in range(min(count, len(self._data)))]
                if array[0] == b"SPACE":
                    space = _frame_in(b" ".join(texts).decode("latin-1"))
            elif kind == b"bit":
                self.values(-(-count // 8) if self._binary else count, b"unsigned_char")
            else:
                self.values(count, kind)
        return space

    def _string(self) -> bytes:
        """Read a text: a line, or bytes after their length in the lower bits of 1, 2, 4 or 8 bytes by the upper two."""
        if not self._binary:
            return self._raw_line().strip()
        if self._at >= len(self._data):
            raise MeshError("the VTK file is cut off: it claims more values than it has.")
        size = (8, 4, 2, 1)[self._data[self._at] >> 6]
        length = int.from_bytes(self._data[self._at : self._at + size], "big") & ((1 << (8 * size - 2)) - 1)
        self._at += size + length
        if self._at > len(self._data):
            raise MeshError("the VTK file is cut off: it claims more values than it has.")
        return self._data[self._at - length : self._at]


def _counted(values: npt.NDArray[np.int64], count: int) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Sizes and vertices of polygons that are stored as their size followed by their vertices."""
    if len(values) == 4 * count and (values[::4] == 3).all():
        return np.full(count, 3), values.reshape(-1, 4)[:, 1:].ravel()
    starts: list[int] = []
    at = 0
    while at < len(values) and len(starts) < count:
        starts.append(at)
        at += 1 + max(int(values[at]), 0)
    if at != len(values) or len(starts) != count:
        raise MeshError("the polygons of the VTK file do not fit their counts; it is damaged.")
    keep = np.ones(len(values), dtype=bool)
    keep[starts] = False
    return values[starts], values[keep]


def _sizes(offsets: npt.NDArray[np.int64], corners: npt.NDArray[np.int64], kind: str) -> npt.NDArray[np.int64]:
    """Sizes of polygons, from the offset of each polygon's vertices, and the end of the last."""
    sizes = np.diff(offsets)
    if len(offsets) == 0 or offsets[0] != 0 or offsets[-1] != len(corners) or (sizes < 0).any():
        raise MeshError(f"the polygons of the {kind} file do not fit their corners; it is damaged.")
    return sizes


# -- XML


def read_vtp(data: bytes) -> tuple[npt.NDArray[Any], npt.NDArray[Any], str | None]:
    """Read vertices, triangles, and the frame in a field 'SPACE'. Raises MeshError."""
    document = _Document(data)
    pieces = document.root.findall("PolyData/Piece")
    if len(pieces) != 1:
        raise MeshError("the VTP file does not hold one piece of a surface.")
    piece = pieces[0]
    if (piece.get("NumberOfStrips") or "0").strip() != "0":
        raise MeshError("the VTP file holds triangle strips; save it with triangles.")
    numbers = document.array(piece.find("Points/DataArray"))
    if len(numbers) % 3:
        raise MeshError(f"the VTP file holds {len(numbers):,} numbers for its points; three are needed for each.")
    points = numbers.reshape(-1, 3)
    found = {one.get("Name"): one for one in piece.findall("Polys/DataArray")}
    corners, ends = (document.array(found.get(name)).astype(np.int64) for name in ("connectivity", "offsets"))
    for key, held, what in (("NumberOfPoints", len(points), "points"), ("NumberOfPolys", len(ends), "polygons")):
        claimed = piece.get(key)
        if claimed is not None and claimed.strip() != str(held):
            raise MeshError(f"the VTP file claims {claimed:.20} {what} and holds {held:,}; it is cut off or damaged.")
    faces = fans(_sizes(np.append(0, ends), corners, "VTP"), corners, "VTP")
    return points.astype(np.float64), faces, document.space()


class _Document:
    """The XML of a file, and its arrays in each of VTK's encodings."""

    def __init__(self, data: bytes) -> None:
        data = without_mark(data, "VTP").lstrip()
        self._appended, self._raw = b"", False
        if found := _APPENDED.search(data):
            end = data.rfind(b"</AppendedData>")
            self._appended, self._raw = data[found.end() : end], found[1] == b"raw"
            data = data[: found.start()] + b"</VTKFile>"
        if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
            raise MeshError("the VTP file declares entities, which is not read.")
        try:
            self.root = fromstring(data)
        except ParseError:
            raise MeshError("the VTP file is cut off or damaged: its XML is not complete.") from None
        if self.root.tag != "VTKFile" or self.root.get("type") != "PolyData":
            raise MeshError("the VTP file is not a surface (PolyData).")
        self._order = {"LittleEndian": "<", "BigEndian": ">"}.get(self.root.get("byte_order", ""), "<")
        self._length = self._order + {"UInt32": "u4", "UInt64": "u8"}.get(self.root.get("header_type", "UInt32"), "u4")
        compressor = self.root.get("compressor")
        if compressor not in (None, "vtkZLibDataCompressor"):
            raise MeshError("the VTP file is packed with another method than zlib; save it with that, or unpacked.")
        self._packed = compressor is not None

    def array(self, element: Element | None) -> npt.NDArray[Any]:
        """The numbers of an array. Raises MeshError."""
        kind = _XML_TYPES.get("" if element is None else element.get("type", ""))
        if element is None or kind is None:
            raise MeshError("the VTP file lacks points or polygons, or they are of a type that is not read.")
        try:
            return self._numbers(element, np.dtype(self._order + kind))
        except (ValueError, binascii.Error, zlib.error, IndexError):
            raise MeshError("an array of the VTP file is cut off or damaged.") from None

    def space(self) -> str | None:
        """'LPS' or 'RAS' of the field 'SPACE'."""
        for element in (*self.root.findall("PolyData/FieldData/Array"), *self.root.findall("FieldData/Array")):
            if element.get("Name") == "SPACE":
                return _frame_in(self._text(element))
        return None

    def _text(self, element: Element) -> str:
        try:
            if element.get("format", "ascii") == "ascii":
                codes = [int(word) for word in _text_of(element).split()]
                return bytes(code for code in codes if 0 < code < 256).decode("latin-1")
            return self._bytes(element).decode("latin-1")
        except (ValueError, binascii.Error, zlib.error, IndexError):
            raise MeshError("the field of the VTP file that names its frame is damaged.") from None

    def _numbers(self, element: Element, kind: np.dtype[Any]) -> npt.NDArray[Any]:
        if element.get("format", "ascii") == "ascii":
            return np.array(_text_of(element).split(), dtype=np.float64 if kind.kind == "f" else np.int64)
        return np.frombuffer(self._bytes(element), kind)

    def _bytes(self, element: Element) -> bytes:
        """Content of a binary or appended array: a header of lengths, and blocks that can be compressed."""
        if element.get("format") == "appended":
            source = self._appended[int(element.get("offset") or 0) :]
            return self._unpacked(source, encoded=not self._raw)
        return self._unpacked("".join(_text_of(element).split()).encode("ascii"), encoded=True)

    def _unpacked(self, source: bytes, *, encoded: bool) -> bytes:
        size = np.dtype(self._length).itemsize
        if not self._packed:
            head = _decoded(source, size) if encoded else source[:size]
            (length,) = np.frombuffer(head, self._length, 1)
            body = _decoded(source, size + int(length)) if encoded else source[: size + int(length)]
            if len(body) < size + int(length):
                raise ValueError
            return body[size : size + int(length)]
        count = int(np.frombuffer(_decoded(source, size) if encoded else source[:size], self._length, 1)[0])
        head_size = size * (3 + count)
        head = _decoded(source, head_size) if encoded else source[:head_size]
        lengths = np.frombuffer(head, self._length, 3 + count).astype(np.int64)
        if lengths[1] * count > MAX_INFLATED:
            raise ValueError
        start = 4 * (-(-head_size // 3)) if encoded else head_size  # the header is encoded separately
        blocks = _decoded(source[start:], int(lengths[3:].sum())) if encoded else source[start:]
        ends = np.cumsum(lengths[3:])
        return b"".join(
            _inflated(blocks[end - length : end], int(max(lengths[1], lengths[2])))
            for end, length in zip(ends, lengths[3:], strict=True)
        )


def _text_of(element: Element) -> str:
    """Text of the element itself, without that of VTK's information keys in it."""
    return " ".join([element.text or "", *(child.tail or "" for child in element)])


def _frame_in(text: str) -> str | None:
    return next((frame for frame in ("LPS", "RAS") if frame in text), None)


def _decoded(source: bytes, size: int) -> bytes:
    """Decode the first bytes of a base64 text."""
    return base64.b64decode(source[: 4 * (-(-size // 3))])[:size]


def _inflated(block: bytes, limit: int) -> bytes:
    inflater = zlib.decompressobj()
    data = inflater.decompress(block, limit + 1)
    if len(data) > limit or not inflater.eof:
        raise ValueError
    return data
