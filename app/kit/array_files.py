"""Stored arrays: NumPy archives (.npz) without pickle (HAZ-22); every size is checked before memory is allocated."""

from __future__ import annotations

import math
import re
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from app.kit.errors import TooLarge
from app.kit.zip_directory import check_directory
from vfix_engine.errors import InputError

MAX_ARRAYS = 32  # in one file; a volume has six
_MAX_HEADER = 4096  # [characters] of one array
_MOST_PACKED = 1032  # highest compression ratio of deflate
_ARRAY = re.compile(r"([a-z_]{1,32})\.npy")
_PLAIN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_KINDS = "biuf"
_OF_HEADER = (
    ValueError, SyntaxError, TypeError, KeyError, OverflowError, RecursionError, MemoryError, tokenize.TokenError,
)  # fmt: skip
_OF_ZIP = (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, OSError, zlib.error)


class ArraysUnusable(InputError):
    """A file is no NumPy archive, is damaged, or contradicts its own headers."""


def is_zip(path: Path) -> bool:
    """Return whether a file begins like a zip, which is how NumPy recognises archives. Raises OSError."""
    with path.open("rb") as file:
        return file.read(2) == b"PK"


def check_arrays(path: Path, most_bytes: int) -> None:
    """Check the headers and sizes of a file of arrays. Raises ArraysUnusable, TooLarge and OSError."""
    with _open(path) as packed:
        infos = _checked(packed, path)
        total = sum(info.file_size for info in infos.values())
        if total > most_bytes:
            raise TooLarge(f"a file of arrays unpacks to {total:,} bytes, which is too much.")
        for info in infos.values():
            _read(packed, info, whole=False)


def read_arrays(path: Path) -> dict[str, Any]:
    """Read all arrays of a file by name. Raises ArraysUnusable, TooLarge and OSError."""
    with _open(path) as packed:
        return {name: _read(packed, info, whole=True) for name, info in _checked(packed, path).items()}


def _open(path: Path) -> zipfile.ZipFile:
    if not is_zip(path):
        raise ArraysUnusable("a file of arrays is no NumPy archive (.npz).")
    try:
        check_directory(path, MAX_ARRAYS)
        return zipfile.ZipFile(path)
    except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError):
        raise ArraysUnusable("a file of arrays is damaged, or has more than NumPy writes.") from None


def _checked(packed: zipfile.ZipFile, path: Path) -> Mapping[str, zipfile.ZipInfo]:
    """Return the entries by the names of their arrays, after checking their sizes against their packed data."""
    infos: dict[str, zipfile.ZipInfo] = {}
    for info in packed.infolist():
        named = _ARRAY.fullmatch(info.filename)
        if named is None or info.filename != info.orig_filename or named[1] in infos or len(infos) == MAX_ARRAYS:
            raise ArraysUnusable("a file of arrays has entries that NumPy does not write.")
        if info.flag_bits & 0x1 or info.compress_type not in _PLAIN:
            raise ArraysUnusable("an array is encrypted or packed in an unknown way.")
        most = 1 if info.compress_type == zipfile.ZIP_STORED else _MOST_PACKED
        if info.file_size > most * info.compress_size:
            raise ArraysUnusable("an array says that it is larger than it can be.")
        infos[named[1]] = info
    if sum(info.compress_size for info in infos.values()) > path.stat().st_size:
        raise ArraysUnusable("the arrays of a file are larger than it.")
    return infos


def _read(packed: zipfile.ZipFile, info: zipfile.ZipInfo, *, whole: bool) -> Any:
    """Read an array; with whole=False check only its header and return None."""
    try:
        with packed.open(info) as entry:
            try:
                version = npy.read_magic(entry)
                if version not in ((1, 0), (2, 0)):
                    raise ValueError("another version")
                header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
                shape, columns_first, dtype = header(entry, max_header_size=_MAX_HEADER)
            except _OF_HEADER:
                raise ArraysUnusable("the header of an array cannot be read.") from None
            if dtype.kind not in _KINDS or any(side < 0 for side in shape):
                raise ArraysUnusable("an array holds something else than numbers.")
            count = math.prod(shape)
            if count * dtype.itemsize != info.file_size - entry.tell():
                raise ArraysUnusable("the shape of an array is not that of what is stored.")
            if not whole:
                return None
            values = np.frombuffer(_bytes(entry, count * dtype.itemsize), dtype=dtype, count=count)
    except _OF_ZIP:
        raise ArraysUnusable("an array cannot be unpacked; the file is damaged.") from None
    return values.reshape(shape, order="F" if columns_first else "C")


def _bytes(entry: Any, length: int) -> bytearray:
    """Read all of an entry into one buffer; zipfile verifies its checksum at the end."""
    found, at = bytearray(length), 0
    with memoryview(found) as view:
        while at < length:
            read = entry.readinto(view[at : at + (1 << 24)])
            if not read:
                raise EOFError
            at += read
    return found
