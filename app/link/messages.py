"""Messages of OpenIGTLink, versions 1 to 3: TRANSFORM, POINT and STRING are packed and unpacked, tool poses unpacked.

Source: http://openigtlink.org/protocols/v2_header.html and its sibling pages, https://openigtlink.org/developers/spec
for the extended header. The checksum is CRC-64/ECMA-182, not reflected, with initial value 0. Numbers are
big-endian; lengths are in mm; matrices and positions are float32.
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from fastcrc import crc64

from vfix_engine.arrays import Array
from vfix_engine.errors import InputError

HEADER_BYTES = 58
MAX_DEVICE_NAME = 20  # [byte]
MAX_POINT_NAME = 64  # [byte]
_HEADER = struct.Struct(">H12s20sIIQQ")
_EXTENDED = struct.Struct(">HHII")
_MATRIX = struct.Struct(">12f")
_POINT = struct.Struct(">64s32s4B4f20s")
_POSITION = struct.Struct(">3f4f")  # position and unit quaternion x, y, z, w
_TOOL = struct.Struct(">20s2x48s")  # of TDATA, with a matrix as in TRANSFORM
_QUATERNION_TOOL = struct.Struct(">20s2x28s")  # of QTDATA, with a pose as in POSITION
_UTF8 = 106  # IANA's number of the character set
_VERSIONS = (1, 2, 3)
_UNIT = 1e-3  # tolerance of the length of a quaternion


class LinkFault(InputError):
    """A message, or a connection, of OpenIGTLink cannot be used."""


@dataclass(frozen=True)
class Header:
    """The header of a body of `size` bytes. time_s: seconds since 1970, 0 if the sender states none."""

    version: int
    kind: str
    name: str
    time_s: float
    size: int
    crc: int


@dataclass(frozen=True, eq=False)
class Transform:
    """A named matrix (4, 4), in mm. metadata: metadata of the sender, such as a tracker's status."""

    name: str
    matrix: Array
    time_s: float = 0.0
    metadata: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ListPoint:
    """A point of a list; position in mm."""

    name: str
    position: tuple[float, float, float]
    colour: tuple[int, int, int, int] = (255, 255, 0, 255)
    diameter_mm: float = 0.0


@dataclass(frozen=True)
class PointList:
    """A named list of points."""

    name: str
    points: tuple[ListPoint, ...]
    time_s: float = 0.0


@dataclass(frozen=True)
class Text:
    """A named text."""

    name: str
    text: str
    time_s: float = 0.0


@dataclass(frozen=True)
class ToolPoses:
    """Named poses of several tools in one message of a tracking server."""

    name: str
    poses: tuple[Transform, ...]


LinkMessage = Transform | PointList | Text


def pack(message: LinkMessage) -> bytes:
    """Return a message with a header of version 1.

    Raises LinkFault for a name that is not ASCII text of 1 to 20 characters, and for a number beyond single precision.
    """
    try:
        kind, body = _packed(message)
    except OverflowError:
        raise LinkFault(f"the message {message.name!r:.60} holds a number too large to send.") from None
    if not message.name.isascii() or not 0 < len(message.name) <= MAX_DEVICE_NAME:
        raise LinkFault(f"a message's name has 1 to {MAX_DEVICE_NAME} ASCII characters, not {message.name!r:.60}.")
    seconds = message.time_s or time.time()
    whole = int(seconds)
    fraction = int((seconds - whole) * 2**32)
    header = _HEADER.pack(1, kind.encode(), message.name.encode(), whole, fraction, len(body), crc64.ecma_182(body))
    return header + body


def parse_header(data: bytes) -> Header:
    """Read a header of 58 bytes. Raises LinkFault if it is invalid."""
    version, kind, name, whole, fraction, size, crc = _HEADER.unpack(data)
    if version not in _VERSIONS:
        raise LinkFault("what came is no OpenIGTLink message of version 1 to 3.")
    return Header(version, _text(kind), _text(name), whole + fraction / 2**32, size, crc)


class WrongChecksum(LinkFault):
    """A message was damaged in transit, or its sender does not compute checksums."""


def unpack(header: Header, body: bytes) -> LinkMessage | ToolPoses | None:
    """Return the message of a header and its body; None for an unsupported kind.

    Raises LinkFault for a damaged body.
    """
    if len(body) != header.size or crc64.ecma_182(body) != header.crc:
        raise WrongChecksum(
            f"the {header.kind} {header.name!r} arrived with a wrong checksum: it was damaged on its way, or its "
            "sender makes no checksums (CRC-64)."
        )
    content, metadata = (body, {}) if header.version == 1 else _without_extension(body)
    try:
        if header.kind == "TRANSFORM":
            return Transform(header.name, _matrix(content), header.time_s, metadata)
        if header.kind == "POINT":
            return PointList(header.name, _points(content), header.time_s)
        if header.kind in ("POSITION", "QTRANS"):
            return Transform(header.name, _posed(content), header.time_s, metadata)
        if header.kind == "TDATA":
            tools = [(_text(name), _matrix(part)) for name, part in _TOOL.iter_unpack(content)]
            return ToolPoses(header.name, tuple(Transform(*tool, header.time_s, metadata) for tool in tools))
        if header.kind == "QTDATA":
            tools = [(_text(name), _posed(part)) for name, part in _QUATERNION_TOOL.iter_unpack(content)]
            return ToolPoses(header.name, tuple(Transform(*tool, header.time_s, metadata) for tool in tools))
        if header.kind == "STRING":
            return Text(header.name, content[4:].decode("utf-8", "replace"), header.time_s)
    except struct.error:
        raise LinkFault(f"the {header.kind} {header.name!r} has a body of a wrong length.") from None
    return None


def cut_name(name: str, most: int = MAX_POINT_NAME - 1) -> str:
    """Return a name cut between characters to fit into `most` bytes of UTF-8."""
    return name.encode("utf-8")[:most].decode("utf-8", "ignore")


def _packed(message: LinkMessage) -> tuple[str, bytes]:
    if isinstance(message, Transform):
        return "TRANSFORM", _MATRIX.pack(*message.matrix[:3].T.ravel())
    if isinstance(message, PointList):
        return "POINT", b"".join(_packed_point(point) for point in message.points)
    text = cut_name(message.text, 2**16 - 1).encode("utf-8")
    return "STRING", struct.pack(">HH", _UTF8, len(text)) + text


def _packed_point(point: ListPoint) -> bytes:
    name = cut_name(point.name).encode("utf-8")
    return _POINT.pack(name, b"", *point.colour, *point.position, point.diameter_mm, b"")


def _matrix(content: bytes) -> Array:
    matrix = np.eye(4)
    matrix[:3] = np.reshape(_MATRIX.unpack(content), (4, 3)).T
    if not np.isfinite(matrix).all():
        raise LinkFault("a matrix holds a number that is not finite.")
    return matrix


def _posed(content: bytes) -> Array:
    """Return the matrix (4, 4) of a position and a quaternion."""
    *place, x, y, z, w = _POSITION.unpack(content)
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not (np.isfinite(place).all() and abs(length - 1.0) <= _UNIT):
        raise LinkFault("a pose is not finite, or its quaternion not of length 1.")
    matrix = np.eye(4)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / length
    matrix[:3, :3] += 2.0 * (w / length) * cross + 2.0 * (cross @ cross)
    matrix[:3, 3] = place
    return matrix


def _points(content: bytes) -> tuple[ListPoint, ...]:
    if len(content) % _POINT.size:
        raise LinkFault("a list of points has a body of a wrong length.")
    found = []
    for name, _, r, g, b, a, x, y, z, diameter, _ in _POINT.iter_unpack(content):
        if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
            raise LinkFault("a point has a coordinate that is not finite.")
        found.append(ListPoint(_text(name), (x, y, z), (r, g, b, a), diameter))
    return tuple(found)


def _without_extension(body: bytes) -> tuple[bytes, dict[str, str]]:
    """Return content and metadata of a body with the extended header of version 3."""
    if len(body) < _EXTENDED.size:
        raise LinkFault("a message's extended header is cut off.")
    header_bytes, index_bytes, metadata_bytes, _ = _EXTENDED.unpack_from(body)
    end = len(body) - index_bytes - metadata_bytes
    if not _EXTENDED.size <= header_bytes <= end:
        raise LinkFault("a message's extended header has lengths that cannot be.")
    return body[header_bytes:end], _metadata(body[end:], index_bytes)


def _metadata(data: bytes, index_bytes: int) -> dict[str, str]:
    """Return metadata by key; {} if it is missing or damaged, which does not affect the content."""
    try:
        (count,) = struct.unpack_from(">H", data)
        sizes = [struct.unpack_from(">HHI", data, 2 + 8 * at) for at in range(count)]
    except struct.error:
        return {}
    found, at = {}, index_bytes
    for key_bytes, _, value_bytes in sizes:
        key, at = data[at : at + key_bytes], at + key_bytes
        value, at = data[at : at + value_bytes], at + value_bytes
        found[_text(key)] = _text(value)
    return found


def _text(data: bytes) -> str:
    return data.split(b"\0", 1)[0].decode("utf-8", "replace").strip()
