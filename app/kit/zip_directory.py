"""Check of the central directory of a zip before Python's reader loads it into memory.

A zip may have several end records, and readers differ in which one they use. Only the layout that `zipfile` writes is
accepted: the central directory, the ZIP64 end record and its locator if a number requires them, and the end record,
without a comment and without gaps (APPNOTE 4.3.14-16).
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from zipfile import BadZipFile

from app.kit.errors import TooLarge

ENTRY_BYTES = 256  # of an entry in the directory: its name of at most 145 characters, and its metadata
_END, _LOCATOR, _LARGE = struct.Struct("<4s4H2LH"), struct.Struct("<4sLQL"), struct.Struct("<4sQ2H2L4Q")


def check_directory(path: Path, most_entries: int) -> None:
    """Check that a zip has one central directory, small enough to be loaded before its entries are counted.

    Raises BadZipFile for a file that is no zip or has another layout, TooLarge and OSError.
    """
    with path.open("rb") as file:
        length = file.seek(0, os.SEEK_END)
        tail_bytes = min(length, _END.size + _LOCATOR.size + _LARGE.size)
        file.seek(length - tail_bytes)
        tail = file.read(tail_bytes)
    if len(tail) < _END.size:
        raise BadZipFile("no end record")
    at = len(tail) - _END.size
    mark, _, _, here, count, size, offset, comment = _END.unpack_from(tail, at)
    if mark != b"PK\x05\x06" or comment:
        raise BadZipFile("no end record at the end")
    needs_large = 0xFFFF in (here, count) or 0xFFFFFFFF in (size, offset)
    if needs_large != (tail[max(0, at - _LOCATOR.size) : at][:4] == b"PK\x06\x07"):
        raise BadZipFile("a ZIP64 record that is missing or not needed")
    if needs_large:
        at -= _LOCATOR.size + _LARGE.size
        if at < 0 or tail[at : at + 4] != b"PK\x06\x06":
            raise BadZipFile("no ZIP64 record before its locator")
        *_, size, offset = _LARGE.unpack_from(tail, at)
    if size > most_entries * ENTRY_BYTES:
        raise TooLarge(f"the zip's list of entries has {size:,} bytes; {most_entries:,} entries are allowed.")
    if offset + size != length - len(tail) + at:
        raise BadZipFile("a list of entries that does not end at the end record")
