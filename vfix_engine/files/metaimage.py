"""MetaImage (.mha): header and voxels in one file; LPS mm by the convention of ITK, which defines the format."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import BinaryIO

import numpy as np

from vfix_engine.errors import ImageError
from vfix_engine.files.grid_header import (
    GridHeader,
    check_length,
    check_not_packed,
    check_sizes,
    check_transform,
    inflated_length,
)

_MAX_HEADER = 1 << 16  # [byte]
_BYTES_OF_TYPE = {
    "MET_CHAR": 1,
    "MET_UCHAR": 1,
    "MET_SHORT": 2,
    "MET_USHORT": 2,
    "MET_INT": 4,
    "MET_UINT": 4,
    "MET_LONG": 4,  # as in the format's own library on every system
    "MET_ULONG": 4,
    "MET_LONG_LONG": 8,
    "MET_ULONG_LONG": 8,
    "MET_FLOAT": 4,
    "MET_DOUBLE": 8,
}


def read_header(path: Path) -> GridHeader:
    """Read and validate the header of a MetaImage and the length of its voxels. Raises ImageError."""
    with path.open("rb") as file:
        fields = _fields(file)
        sizes = check_sizes(_without_single(fields))
        item = _BYTES_OF_TYPE.get(fields.get("ElementType", ""))
        if item is None or fields.get("ElementNumberOfChannels", "1") != "1":
            raise ImageError("the MetaImage file holds a type of voxel that is not a plain number.")
        claimed = math.prod(sizes) * item
        if fields.get("CompressedData", "False").lower() == "true":
            check_length(inflated_length(file, 15, claimed), claimed)
        else:
            check_length(os.fstat(file.fileno()).st_size - file.tell(), claimed)
    transform, axes = np.eye(4), int(fields["NDims"])
    # Row n of the stored matrix is the direction of axis n.
    matrix = _numbers(fields, ("TransformMatrix", "Orientation", "Rotation"), axes * axes)
    directions = np.array(matrix).reshape(axes, axes)
    if directions[:3, 3:].any() or directions[3:, :3].any():
        raise ImageError("the MetaImage header turns an axis of space into one that is not of space.")
    spacing = _numbers(fields, ("ElementSpacing", "ElementSize"), axes)[:3]
    if min(spacing) <= 0.0:
        raise ImageError(
            f"the ElementSpacing of the MetaImage header is {' x '.join(f'{mm:g}' for mm in spacing)} mm; it must be "
            "above 0. Mirrored axes belong into the TransformMatrix."
        )
    transform[:3, :3] = directions[:3, :3].T * spacing
    transform[:3, 3] = _numbers(fields, ("Offset", "Position", "Origin"), axes)[:3]
    return GridHeader(sizes, check_transform(transform, 1.0), "LPS", "mm")


def _fields(file: BinaryIO) -> dict[str, str]:
    fields: dict[str, str] = {}
    while "ElementDataFile" not in fields:
        line = file.readline(_MAX_HEADER)
        check_not_packed(line, ".mha")
        key, equals, value = line.decode("latin-1").partition("=")
        if not equals or not line.endswith(b"\n") or file.tell() > _MAX_HEADER or key.strip() in fields:
            raise ImageError("the MetaImage header is cut off or damaged, or the file is not MetaImage.")
        fields[key.strip()] = value.strip()
    if fields["ElementDataFile"].upper() != "LOCAL":
        raise ImageError("the MetaImage header names another file for its voxels; save it as one .mha file.")
    if fields.get("NDims") not in ("3", "4", "5") or fields.get("BinaryData", "True").lower() != "true":
        raise ImageError("the MetaImage file is not a binary volume of three dimensions.")
    return fields


def _without_single(fields: dict[str, str]) -> list[int]:
    """Sizes of the axes, without axes of one voxel after the third, such as time."""
    sizes = [_whole(word) for word in fields.get("DimSize", "").split()]
    if len(sizes) != int(fields["NDims"]) or any(size != 1 for size in sizes[3:]):
        raise ImageError("the MetaImage file has more than three dimensions of more than one voxel.")
    return sizes[:3]


def _whole(word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 10):
        raise ImageError("the sizes in the MetaImage header are not whole numbers.")
    return int(word)


def _numbers(fields: dict[str, str], names: tuple[str, ...], count: int) -> list[float]:
    text = next((fields[name] for name in names if name in fields), "")
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count:
        raise ImageError(f"the MetaImage header does not give {count} numbers for '{names[0]}'.")
    return values
