"""NRRD: header checked field by field (teem.sourceforge.net/nrrd/format.html), data attached, raw or gzip."""

from __future__ import annotations

import math
import os
import re
import shutil
from pathlib import Path
from typing import BinaryIO

import numpy as np

from vfix_engine.errors import ImageError
from vfix_engine.imaging.grid_header import (
    GridHeader,
    check_length,
    check_not_packed,
    check_sizes,
    check_transform,
    inflated_length,
)

_MAX_HEADER = 1 << 16  # [byte]
_MAGIC = re.compile(rb"NRRD000[1-5]\r?\n")
# 3D Slicer marks each of its segmentations with such keys, one layer or several.
_SEGMENTATION = re.compile(r"(Segmentation_|Segment\d+_)\w+:=")
_SPACES = {"LPS": "left-posterior-superior", "RAS": "right-anterior-superior"}
_FRAMES = {word: frame for frame, space in _SPACES.items() for word in (space, frame.lower())}
_NAMELESS_SPACES = {"", "scanner-xyz", "3d-right-handed", "3d-left-handed"}
_ITEM_BYTES = (
    (1, ("signed char", "int8", "int8_t", "uchar", "unsigned char", "uint8", "uint8_t")),
    (2, ("short", "short int", "signed short", "signed short int", "int16", "int16_t")),
    (2, ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t")),
    (4, ("int", "signed int", "int32", "int32_t", "uint", "unsigned int", "uint32", "uint32_t", "float")),
    (8, ("double",)),
)
_BYTES_OF_TYPE = {name: size for size, names in _ITEM_BYTES for name in names}


def read_header(path: Path) -> GridHeader:
    """The checked header of an NRRD file, its voxels counted. Raises ImageError."""
    with path.open("rb") as file:
        fields = _fields(file)
        sizes = _sizes(fields)
        item = _BYTES_OF_TYPE.get(fields.get("type", "").lower())
        if item is None:
            raise ImageError("the NRRD file holds a type of voxel that is not a plain number.")
        if item > 1 and fields.get("endian", "").lower() not in ("little", "big"):
            raise ImageError("the NRRD header does not say the order of bytes in a voxel ('endian: little' or 'big').")
        claimed = math.prod(sizes) * item
        encoding = fields.get("encoding", "").lower()
        if encoding == "raw":
            check_length(os.fstat(file.fileno()).st_size - file.tell(), claimed)
        elif encoding in ("gzip", "gz"):
            check_length(inflated_length(file, 31, claimed), claimed)
        else:
            raise ImageError("the NRRD file is neither raw nor gzip encoded; save it as one of these.")
    unit = _unit(fields)
    transform = check_transform(_transform(fields), 1.0 if unit == "mm" else 1000.0)
    return GridHeader(sizes, transform, _frame(fields), unit)


def write_named(path: Path, frame: str, named: Path) -> None:
    """Copy an NRRD file whose frame is not named, with the frame ('LPS' or 'RAS') in its header.

    The library behind SimpleITK refuses a placed volume whose space has no name.
    """
    with path.open("rb") as source, named.open("wb") as target:
        target.write(source.readline())
        target.write(f"space: {_SPACES[frame]}\n".encode("ascii"))
        while (line := source.readline()).strip():
            if line.partition(b":")[0].strip().lower() not in (b"space", b"space dimension"):
                target.write(line)
        target.write(b"\n")
        shutil.copyfileobj(source, target)


def _fields(file: BinaryIO) -> dict[str, str]:
    magic = file.readline(16)
    check_not_packed(magic, ".nrrd")
    if _MAGIC.fullmatch(magic) is None:
        raise ImageError("the file is not NRRD: its first line is not NRRD0001 to NRRD0005.")
    fields: dict[str, str] = {}
    while True:
        line = file.readline(_MAX_HEADER)
        if not line.endswith(b"\n") or file.tell() > _MAX_HEADER:
            raise ImageError("the NRRD header does not end; the file is cut off or damaged.")
        text = line.decode("latin-1").strip()
        if not text:
            break
        if _SEGMENTATION.match(text):
            raise ImageError(
                "the file is a segmentation (.seg.nrrd), whose voxels are labels, not Hounsfield units; "
                "import the CT that it was drawn on."
            )
        if text.startswith("#") or ":=" in text:
            continue
        key, colon, value = text.partition(":")
        key = key.strip().lower()
        if not colon or key in fields:
            raise ImageError("the NRRD header has a line that is no field, or a field twice.")
        fields[key] = value.strip()
    for refused in ("data file", "datafile", "line skip", "lineskip", "byte skip", "byteskip"):
        if fields.get(refused, "0") != "0":
            raise ImageError(f"an NRRD file with '{refused}' is not read; save header and voxels in one file.")
    return fields


def _sizes(fields: dict[str, str]) -> tuple[int, int, int]:
    if fields.get("dimension") != "3":
        raise ImageError("the NRRD file does not have three dimensions.")
    words = fields.get("sizes", "").split()
    if not all(word.isascii() and word.isdigit() and len(word) < 10 for word in words):
        raise ImageError("the sizes in the NRRD header are not whole numbers.")
    return check_sizes([int(word) for word in words])


def _frame(fields: dict[str, str]) -> str | None:
    space = fields.get("space", "").lower()
    if space in _NAMELESS_SPACES:
        return None
    if space not in _FRAMES:
        raise ImageError("the NRRD file's space is neither left-posterior-superior nor right-anterior-superior.")
    return _FRAMES[space]


def _unit(fields: dict[str, str]) -> str:
    units: set[str] = set(re.findall(r'"([^"]*)"', fields.get("space units", ""))) or {"mm"}
    if units not in ({"mm"}, {"m"}):
        raise ImageError("the NRRD file's space units are neither mm nor m.")
    return units.pop()


def _transform(fields: dict[str, str]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    directions = [_triple(text) for text in re.findall(r"\(([^)]*)\)", fields.get("space directions", ""))]
    if len(directions) != 3:
        raise ImageError("the NRRD file has no direction for each of its three axes ('space directions').")
    origins = re.findall(r"\(([^)]*)\)", fields.get("space origin", ""))
    if len(origins) != 1:
        raise ImageError("the NRRD file does not say where its first voxel is ('space origin').")
    transform = np.eye(4)
    transform[:3, :3] = np.array(directions).T
    transform[:3, 3] = _triple(origins[0])
    return transform


def _triple(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise ImageError("a vector in the NRRD header is not three numbers.")
    return values
