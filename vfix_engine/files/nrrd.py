"""NRRD: header validated field by field (teem.sourceforge.net/nrrd/format.html), data attached, raw or gzip."""

from __future__ import annotations

import math
import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import ImageError, SegmentationFound
from vfix_engine.files.grid_header import (
    GridHeader,
    check_length,
    check_not_packed,
    check_sizes,
    check_transform,
    inflated_length,
)

_MAX_HEADER = 1 << 16  # [byte]
_MAGIC = re.compile(rb"NRRD000[1-5]\r?\n")
# 3D Slicer marks its segmentations with such keys, with one layer or several.
_SEGMENTATION = re.compile(r"(Segmentation_|Segment\d+_)\w+")
INTO_A_CASE = (
    "Import it into the case of its CT: with the case open at the Patient step, or by 'vfix import --into CASE FILE'."
)
_OF_ALL_AXES = ("type", "endian", "encoding", "space origin", "space units")  # fields that are not per axis
_DIRECTION = re.compile(r"none|\([^)]*\)")
_SPACES = {"LPS": "left-posterior-superior", "RAS": "right-anterior-superior"}
_FRAMES = {word: frame for frame, space in _SPACES.items() for word in (space, frame.lower())}
_NAMELESS_SPACES = {"", "scanner-xyz", "3d-right-handed", "3d-left-handed"}
_CODES = (
    ("i1", ("signed char", "int8", "int8_t")),
    ("u1", ("uchar", "unsigned char", "uint8", "uint8_t")),
    ("i2", ("short", "short int", "signed short", "signed short int", "int16", "int16_t")),
    ("u2", ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t")),
    ("i4", ("int", "signed int", "int32", "int32_t")),
    ("u4", ("uint", "unsigned int", "uint32", "uint32_t")),
    ("i8", ("longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t")),
    ("u8", ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t")),
    ("f4", ("float",)),
    ("f8", ("double",)),
)
_TYPES = {name: code for code, names in _CODES for name in names}


def read_header(path: Path) -> GridHeader:
    """Read and validate the header of an NRRD file and the length of its voxels. Raises ImageError."""
    with path.open("rb") as file:
        fields, keys = read_fields(file)
        if is_segmentation(keys):
            raise SegmentationFound(
                f"the file is a segmentation (.seg.nrrd), whose voxels are labels, not Hounsfield units. {INTO_A_CASE}"
            )
        sizes = _sizes(fields)
        claimed = math.prod(sizes) * voxel_type(fields).itemsize
        if is_packed(fields):
            check_length(inflated_length(file, 31, claimed), claimed)
        else:
            check_length(os.fstat(file.fileno()).st_size - file.tell(), claimed)
    return GridHeader(sizes, *placement(fields), further_axes=fields.get("dimension") != "3")


def is_segmentation(keys: Mapping[str, str]) -> bool:
    """Whether keys of a header mark a segmentation of 3D Slicer, of one layer or several."""
    return any(_SEGMENTATION.match(key) for key in keys)


def marks_segmentation(path: Path) -> bool:
    """Whether a file is an NRRD that is marked as a segmentation. Raises ImageError if its header is damaged."""
    with path.open("rb") as file:
        return is_segmentation(read_fields(file)[1])


def voxel_type(fields: Mapping[str, str]) -> np.dtype[Any]:
    """Type and byte order of a voxel. Raises ImageError."""
    code = _TYPES.get(fields.get("type", "").lower())
    if code is None:
        raise ImageError("the NRRD file holds a type of voxel that is not a plain number.")
    orders = {"little": "<", "big": ">"}
    order = orders.get(fields.get("endian", "").lower())
    if np.dtype(code).itemsize > 1 and order is None:
        raise ImageError("the NRRD header does not say the order of bytes in a voxel ('endian: little' or 'big').")
    return np.dtype((order or "") + code)


def is_packed(fields: Mapping[str, str]) -> bool:
    """Whether the voxels are compressed with gzip. Raises ImageError for encodings other than raw and gzip."""
    encoding = fields.get("encoding", "").lower()
    if encoding not in ("raw", "gzip", "gz"):
        raise ImageError("the NRRD file is neither raw nor gzip encoded; save it as one of these.")
    return encoding != "raw"


def placement(fields: Mapping[str, str]) -> tuple[npt.NDArray[np.float64], str | None, str]:
    """((4, 4) from the index of the three spatial axes to the file's frame and unit, frame or None, unit)."""
    unit = _unit(fields)
    transform = check_transform(_transform(fields), 1.0 if unit == "mm" else 1000.0)
    return transform, _frame(fields), unit


def write_plain(path: Path, frame: str, plain: Path) -> None:
    """Copy an NRRD file with a header of three axes and a stated frame ('LPS' or 'RAS').

    SimpleITK's NRRD library refuses a volume with directions whose space is unnamed, and some with further axes.
    """
    with path.open("rb") as source, plain.open("wb") as target:
        fields, _ = read_fields(source)
        given = {
            "dimension": "3",
            "space": _SPACES[frame],
            "sizes": " ".join(map(str, _sizes(fields))),
            "space directions": " ".join(re.findall(r"\([^)]*\)", fields.get("space directions", ""))),
        }
        kept = {key: fields[key] for key in _OF_ALL_AXES if key in fields}
        lines = "".join(f"{key}: {value}\n" for key, value in (given | kept).items())
        target.write(f"NRRD0005\n{lines}\n".encode("latin-1"))
        shutil.copyfileobj(source, target)


def read_fields(file: BinaryIO) -> tuple[dict[str, str], dict[str, str]]:
    """Read fields and keys of the header, up to the first voxel. Raises ImageError."""
    magic = file.readline(16)
    check_not_packed(magic, ".nrrd")
    if _MAGIC.fullmatch(magic) is None:
        raise ImageError("the file is not NRRD: its first line is not NRRD0001 to NRRD0005.")
    fields: dict[str, str] = {}
    keys: dict[str, str] = {}
    while True:
        line = file.readline(_MAX_HEADER)
        if not line.endswith(b"\n") or file.tell() > _MAX_HEADER:
            raise ImageError("the NRRD header does not end; the file is cut off or damaged.")
        text = line.decode("latin-1").strip()
        if not text:
            break
        if text.startswith("#"):
            continue
        if ":=" in text:
            key, _, value = text.partition(":=")
            keys[key.strip()] = value
            continue
        key, colon, value = text.partition(":")
        key = key.strip().lower()
        if not colon or key in fields:
            raise ImageError("the NRRD header has a line that is no field, or a field twice.")
        fields[key] = value.strip()
    for refused in ("data file", "datafile", "line skip", "lineskip", "byte skip", "byteskip"):
        if fields.get(refused, "0") != "0":
            raise ImageError(f"an NRRD file with '{refused}' is not read; save header and voxels in one file.")
    return fields, keys


def _sizes(fields: Mapping[str, str]) -> tuple[int, int, int]:
    """Sizes of the three axes with a direction in space; further axes, such as time, have one voxel."""
    words = fields.get("sizes", "").split()
    if not all(word.isascii() and word.isdigit() and len(word) < 10 for word in words):
        raise ImageError("the sizes in the NRRD header are not whole numbers.")
    sizes = [int(word) for word in words]
    if fields.get("dimension") != str(len(sizes)):
        raise ImageError("the NRRD file has another number of dimensions than of sizes.")
    if len(sizes) > 3:
        directions = _DIRECTION.findall(fields.get("space directions", "").lower())
        further = [size for size, direction in zip(sizes, directions, strict=False) if direction == "none"]
        if len(directions) != len(sizes) or len(further) != len(sizes) - 3 or set(further) != {1}:
            raise ImageError("the NRRD file has more than three dimensions of more than one voxel.")
        sizes = [size for size, direction in zip(sizes, directions, strict=True) if direction != "none"]
    return check_sizes(sizes)


def _frame(fields: Mapping[str, str]) -> str | None:
    space = fields.get("space", "").lower()
    if space in _NAMELESS_SPACES:
        return None
    if space not in _FRAMES:
        raise ImageError("the NRRD file's space is neither left-posterior-superior nor right-anterior-superior.")
    return _FRAMES[space]


def _unit(fields: Mapping[str, str]) -> str:
    units: set[str] = set(re.findall(r'"([^"]*)"', fields.get("space units", ""))) or {"mm"}
    if units not in ({"mm"}, {"m"}):
        raise ImageError("the NRRD file's space units are neither mm nor m.")
    return units.pop()


def _transform(fields: Mapping[str, str]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
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
