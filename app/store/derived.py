"""Files computed from stored ones: by the hash of their input; what is missing is computed again."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import BinaryIO

from app.store.errors import StorageError
from app.store.files import sync_folder
from app.store.private import private_folder
from app.store.scratch import Scratch


class DerivedFiles:
    """One file an input and kind, named `<hash of the input>.<kind>`. No row names them, so no export holds them."""

    def __init__(self, folder: Path, scratch: Scratch) -> None:
        """scratch: on the disk of the folder, so that a rename is enough."""
        self._folder, self._scratch = folder, scratch

    def path(self, key: str, kind: str) -> Path | None:
        """Path of the file; None where there is none."""
        path = self._path(key, kind)
        return path if path.is_file() else None

    def put(self, key: str, kind: str, write: Callable[[BinaryIO], object]) -> None:
        """Store the output of `write`, in place of what was there. Raises StorageError."""
        temporary = self._scratch.open() / secrets.token_hex(8)
        try:
            private_folder(self._folder)
            with open(temporary, "xb", opener=_private) as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, self._path(key, kind))
            sync_folder(self._folder)
        except OSError as error:
            raise StorageError(f"a file could not be stored: {error.strerror or error}.") from error
        finally:
            temporary.unlink(missing_ok=True)

    def keys(self) -> set[str]:
        """The hashes of all inputs of which there is a file."""
        return {path.name.partition(".")[0] for path in self._folder.glob("*.*")}

    def trim(self, key: str, kinds: str, most: int) -> None:
        """Delete the oldest files of an input, of kinds as a pattern, so that at most so many are left."""
        try:
            found = sorted(self._folder.glob(f"{key}.{kinds}"), key=lambda path: path.stat().st_mtime_ns)
            for path in found[: max(0, len(found) - most)]:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise StorageError(f"a stored file could not be deleted: {error.strerror or error}.") from error

    def remove(self, keys: Iterable[str]) -> int:
        """Delete every file of these inputs; returns how many. Raises StorageError."""
        try:
            found = [path for key in keys for path in self._folder.glob(f"{key}.*")]
            for path in found:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise StorageError(f"a stored file could not be deleted: {error.strerror or error}.") from error
        return len(found)

    def _path(self, key: str, kind: str) -> Path:
        return self._folder / f"{key}.{kind}"


def _private(path: str, flags: int) -> int:
    return os.open(path, flags, 0o600)
