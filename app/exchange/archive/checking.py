"""Checks of an untrusted archive: every name, size and checksum is verified before its content is used."""

from __future__ import annotations

import hashlib
import stat
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from app.exchange.archive.layout import (
    CASE,
    ENTRY,
    FREE_BYTES,
    MANIFEST,
    MAX_ENTRIES,
    MAX_JSON_BYTES,
    MAX_RATIO,
    MAX_TOTAL_BYTES,
    SCHEMA,
    SUMS,
)
from app.kit.errors import TooLarge
from app.kit.zip_directory import check_directory
from app.store.files import check_regular
from vfix_engine.errors import InputError
from vfix_engine.json_text import parse_json

_PIECE = 1 << 20
_DAMAGED = (zipfile.BadZipFile, zipfile.LargeZipFile, EOFError, NotImplementedError, ValueError, OSError)
_PLAIN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)

ReportFraction = Callable[[float], object]


def is_archive(path: Path) -> bool:
    """Return whether a file is the archive of a case, rather than another zip."""
    try:
        check_directory(path, MAX_ENTRIES)
        with zipfile.ZipFile(path) as packed:
            return {MANIFEST, CASE, SUMS} <= set(packed.namelist())
    except (*_DAMAGED, TooLarge):
        return False


class CheckedArchive:
    """An archive whose names and sizes have been checked; a context manager.

    Raises InputError for a damaged or foreign file, and TooLarge for a decompression bomb.
    """

    def __init__(self, path: Path) -> None:
        try:
            check_regular(path)
            check_directory(path, MAX_ENTRIES)
            self._zip = zipfile.ZipFile(path)
        except OSError as error:
            raise InputError(f"{path.name} cannot be read: {error.strerror or error}.") from None
        except _DAMAGED:
            raise InputError("the file is no zip, or is cut off; send the archive again, whole.") from None
        try:
            self.entries = _entries(self._zip.infolist(), path.stat().st_size)
            self.sums = self._sums()
            self.manifest = self._manifest()
        except BaseException:
            self._zip.close()
            raise

    def __enter__(self) -> CheckedArchive:
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    def json(self, name: str) -> dict[str, Any]:
        """Return an entry as a JSON object after verifying its checksum."""
        data = self._read(name)
        if hashlib.sha256(data).hexdigest() != self.sums[name]:
            raise _changed(name)
        try:
            value = parse_json(data.decode("utf-8"))
        except ValueError as error:
            raise InputError(f"{name} of the archive is not sound JSON: {error}.") from None
        if not isinstance(value, dict):
            raise InputError(f"{name} of the archive must hold one JSON object.")
        return value

    def check(self, progress: ReportFraction) -> None:
        """Verify the checksum of every entry. progress: called with the fraction of all bytes done; it may raise."""
        total, done = sum(info.file_size for info in self.entries.values()) or 1, 0
        for name in self.sums:
            digest, left = hashlib.sha256(), self.entries[name].file_size
            with _open_entry(self._zip, name) as entry:
                while piece := _piece(entry, name):
                    digest.update(piece)
                    left, done = left - len(piece), done + len(piece)
                    progress(done / total)
            if left or digest.hexdigest() != self.sums[name]:
                raise _changed(name)

    def copy(self, name: str, target: BinaryIO, progress: ReportFraction) -> None:
        """Write an entry into a file. The store verifies its checksum, since it names files by their SHA-256."""
        total, done = self.entries[name].file_size or 1, 0
        with _open_entry(self._zip, name) as entry:
            while piece := _piece(entry, name):
                target.write(piece)
                done += len(piece)
                progress(done / total)

    def _read(self, name: str) -> bytes:
        info = self.entries.get(name)
        if info is None:
            raise InputError(f"the archive has no {name}; it is not one of vfix, or not whole.")
        if info.file_size > MAX_JSON_BYTES:
            raise TooLarge(f"{name} of the archive has {info.file_size:,} bytes; {MAX_JSON_BYTES:,} are allowed.")
        with _open_entry(self._zip, name) as entry:
            data = b""
            while piece := _piece(entry, name):
                data += piece
        return data

    def _sums(self) -> dict[str, str]:
        found: dict[str, str] = {}
        for line in self._read(SUMS).decode("utf-8", "replace").splitlines():
            digest, _, name = line.partition("  ")
            if name in found or len(digest) != 64 or set(digest) - set("0123456789abcdef"):
                raise InputError(f"a line of {SUMS} cannot be read: {line!r:.80}.")
            found[name] = digest
        for name in set(found) ^ (set(self.entries) - {SUMS}):
            where = "is in the archive without a checksum" if name in self.entries else "has a checksum and is missing"
            raise InputError(f"{name!r:.100} {where}; the archive was changed or is not whole.")
        return found

    def _manifest(self) -> dict[str, Any]:
        manifest = self.json(MANIFEST)
        schema = manifest.get("schema")
        if schema != SCHEMA:
            raise InputError(
                f"the archive's schema is {str(schema)!r:.60}; this vfix reads {SCHEMA!r}. "
                "Where a newer vfix made it, install that."
            )
        if CASE not in self.entries:
            raise InputError(f"the archive has no {CASE}; it is not whole.")
        return manifest


def _entries(infos: list[zipfile.ZipInfo], size: int) -> dict[str, zipfile.ZipInfo]:
    """Return the entries by name. Raises InputError for anything that vfix never writes into an archive."""
    if len(infos) > MAX_ENTRIES:
        raise TooLarge(f"the archive has {len(infos):,} entries; {MAX_ENTRIES:,} are allowed.")
    found: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        name = info.filename
        # `filename` ends at a null byte, so that a zip could hide the rest of a name behind one.
        if not ENTRY.fullmatch(name) or info.orig_filename != name:
            raise InputError(f"the archive holds {info.orig_filename!r:.100}, which is no part of a case.")
        if stat.S_ISLNK(info.external_attr >> 16):
            raise InputError(f"{name!r:.100} of the archive is a symbolic link, which is never followed.")
        if name in found:
            raise InputError(f"{name!r:.100} is twice in the archive.")
        if info.flag_bits & 0x1 or info.compress_type not in _PLAIN:
            raise InputError(f"{name!r:.100} is encrypted, or packed in a way that is not read; pack it anew.")
        found[name] = info
    total = sum(info.file_size for info in infos)
    if total > MAX_TOTAL_BYTES:
        raise TooLarge(f"the archive unpacks to {total:,} bytes; {MAX_TOTAL_BYTES:,} are allowed.")
    if total > FREE_BYTES and total > MAX_RATIO * size:
        raise TooLarge(f"the archive unpacks to {total / max(size, 1):.0f} times its size, which no case does.")
    return found


def _open_entry(archive: zipfile.ZipFile, name: str) -> Any:
    try:
        return archive.open(name)
    except (*_DAMAGED, RuntimeError):
        raise _unreadable(name) from None


def _piece(entry: Any, name: str) -> bytes:
    """Return the next bytes of an entry; zipfile never returns more than the announced size."""
    try:
        piece: bytes = entry.read(_PIECE)
    except (*_DAMAGED, zlib.error):
        raise _unreadable(name) from None
    return piece


def _unreadable(name: str) -> InputError:
    return InputError(f"{name!r:.100} of the archive cannot be read; the archive is damaged or cut off.")


def _changed(name: str) -> InputError:
    return InputError(f"{name!r:.100} of the archive is not what its checksum says; the archive is damaged.")
