"""Atomic writing of files, and content-addressed storage."""

import contextlib
import hashlib
import os
import secrets
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from app.store.errors import StorageError
from app.store.scratch import Scratch
from vfix_engine.errors import InputError


def check_regular(path: Path) -> None:
    """Raise InputError if the path is something other than a regular file, such as a device or a pipe."""
    try:
        is_other = not stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError):  # nothing is there, which opening it reports
        return
    if is_other:
        raise InputError(f"{path} is not a regular file; name another one.")


def write_atomically(path: Path, data: bytes) -> None:
    """Write `data` to `path` atomically: after a crash or on a full disk the old or the new file is complete (HAZ-25).

    Raises InputError if the path is something other than a regular file, and StorageError with the system's reason.
    """
    with open_atomically(path) as file:
        file.write(data)


@contextlib.contextmanager
def open_atomically(path: Path) -> Iterator[BinaryIO]:
    """Open a file that durably replaces `path` at the end of the block; if the block raises, `path` is unchanged.

    Raises InputError if the path is something other than a regular file, and StorageError with the system's reason.
    """
    check_regular(path)
    try:
        descriptor, temporary = tempfile.mkstemp(prefix=".vfix-", dir=path.parent)
        try:
            with os.fdopen(descriptor, "w+b") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
            raise
        sync_folder(path.parent)
    except OSError as error:
        raise StorageError(f"{path.name or path} could not be written: {error.strerror or error}.") from error


def sync_folder(folder: Path) -> None:
    """Make a rename in `folder` durable, where the platform allows a folder to be opened."""
    if os.name == "nt":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


class FileStore:
    """Immutable files under their SHA-256; equal content is stored once. Incomplete files are in `scratch`."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.scratch = Scratch(folder / "tmp")  # on the disk of the files, so that a rename is enough

    def put_with(self, write: Callable[[BinaryIO], object]) -> str:
        """Store the output of `write`, without holding it in memory. Raises StorageError."""
        temporary = self.scratch.open() / secrets.token_hex(8)
        try:
            with temporary.open("xb+") as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
                file.seek(0)
                key = hashlib.file_digest(file, "sha256").hexdigest()
            path = self._path(key)
            _move_in(temporary, path)
            sync_folder(path.parent)
            sync_folder(self._folder)
        except OSError as error:
            raise StorageError(f"a file could not be stored: {error.strerror or error}.") from error
        finally:
            temporary.unlink(missing_ok=True)
        return key

    def path(self, key: str) -> Path:
        """Path of the file. Raises StorageError when it is missing."""
        path = self._path(key)
        if not path.is_file():
            raise StorageError(f"the stored file {key[:12]} is missing; import the case again.")
        return path

    def has(self, key: str) -> bool:
        """Whether the file exists."""
        return self._path(key).is_file()

    def keys(self, older_than_s: float = 0.0) -> list[str]:
        """Keys of the files older than the given age."""
        before = time.time() - older_than_s
        found = [path for path in self._folder.glob("??/*") if len(path.name) == 64]
        return sorted(path.name for path in found if _changed_before(path, before))

    def remove(self, key: str) -> None:
        """Delete a file if it exists, and its folder if that is empty then. Raises StorageError."""
        path = self._path(key)
        try:
            path.unlink(missing_ok=True)
            with contextlib.suppress(OSError):  # the folder is not empty, or gone
                path.parent.rmdir()
        except OSError as error:
            raise StorageError(f"a stored file could not be deleted: {error.strerror or error}.") from error

    def _path(self, key: str) -> Path:
        if len(key) != 64 or not set(key) <= set("0123456789abcdef"):
            raise StorageError("a stored file is named by 64 hexadecimal digits.")
        return self._folder / key[:2] / key


def _move_in(temporary: Path, path: Path) -> None:
    """Move a file into its folder, which another planner may remove while it is still empty."""
    for last in (False, False, True):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.replace(temporary, path)
            return
        except FileNotFoundError:
            if last:
                raise


def _changed_before(path: Path, when: float) -> bool:
    try:
        return path.stat().st_mtime <= when
    except FileNotFoundError:  # another planner has just deleted it
        return False
