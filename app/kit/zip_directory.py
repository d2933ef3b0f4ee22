"""The list of entries at the end of a zip, measured before Python's reader takes it into memory.

A zip may have end records of several kinds, at places that readers choose differently; here there is one reading, that
of a zip as `zipfile` writes it: the list, the larger end record of ZIP64 and its locator where one number needs them,
and the end record, without a comment and with nothing between (APPNOTE 4.3.14-16).
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from zipfile import BadZipFile

from app.kit.errors import TooLarge

ENTRY_BYTES = 256  # of an entry in the list: its name of at most 145 characters, and what is said of it
_END, _LOCATOR, _LARGE = struct.Struct("<4s4H2LH"), struct.Struct("<4sLQL"), struct.Struct("<4sQ2H2L4Q")


def check_directory(path: Path, most_entries: int) -> None:
    """Refuse a list that would fill the memory before its entries are counted, and one that is not the only one.

    Raises BadZipFile for what is no zip, or none of that form, TooLarge and OSError.
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
