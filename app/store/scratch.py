"""Temporary data, such as uploads and decoded images, in a folder per planner process that is removed at its end.

Several planners may share one data folder: the folder of another one is removed only when its lock is free.
"""

from __future__ import annotations

import os
import secrets
import shutil
import sys
import threading
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from app.store.errors import StorageError

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_LOCK = ".lock"


class Scratch:
    """Temporary folders of the planners of a data folder; thread-safe.

    rescue: called with the folder of a planner that ends or was killed, before that is removed; False keeps it for the
    next start.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.rescue: Callable[[Path], bool] = lambda left: True
        self._guard = threading.Lock()
        self._own: Path | None = None
        self._let_go: weakref.finalize[..., Scratch] | None = None

    def open(self) -> Path:
        """Return the folder of this planner; the first call removes those of ended planners. Raises StorageError."""
        with self._guard:
            if self._own is None:
                try:
                    self._own = self._create()
                except OSError as error:
                    raise _no_room(error) from error
            return self._own

    def new_place(self) -> Path:
        """Create a folder in the folder of this planner. Raises StorageError."""
        place = self.open() / secrets.token_hex(8)
        try:
            place.mkdir(mode=0o700)
        except OSError as error:
            raise _no_room(error) from error
        return place

    def close(self) -> None:
        """Remove the folder of this planner; also done at exit, unless it is killed."""
        with self._guard:
            if self._let_go is not None:
                if self._own is None or self.rescue(self._own):
                    self._let_go()
                elif (held := self._let_go.detach()) is not None:
                    held[2][1].close()  # the lock; the next start takes the folder up
            self._own = self._let_go = None

    def _create(self) -> Path:
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        with (self._folder / _LOCK).open("ab") as door:
            _lock(door, wait=True)  # other planners must not see a lock file before it is locked
            self._remove_leftovers()
            own = self._folder / secrets.token_hex(8)
            lock_file = own.with_suffix(_LOCK).open("ab")
            self._let_go = weakref.finalize(self, _remove, own, lock_file, os.getpid())
            try:
                _lock(lock_file, wait=False)
                own.mkdir(mode=0o700)
            except OSError:
                self._let_go()  # the next call creates a new lock
                self._let_go = None
                raise
        return own

    def _remove_leftovers(self) -> None:
        for path in sorted(self._folder.iterdir(), key=lambda path: path.suffix == _LOCK):  # locks after folders
            lock = path if path.suffix == _LOCK else path.with_name(path.name + _LOCK)
            if path.name == _LOCK or _is_held(lock):
                continue
            if path.is_dir() and not path.is_symlink():
                if self.rescue(path):
                    shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _remove(own: Path, lock_file: BinaryIO, owner: int) -> None:
    if os.getpid() == owner:  # not in a forked child that exits
        shutil.rmtree(own, ignore_errors=True)
        own.with_suffix(_LOCK).unlink(missing_ok=True)
    lock_file.close()


def _no_room(error: OSError) -> StorageError:
    return StorageError(f"the data folder takes no temporary files: {error.strerror or error}.")


def _is_held(path: Path) -> bool:
    """Return whether a running planner holds the lock of this file."""
    if not path.is_file():
        return False
    with path.open("ab") as file:
        return not _lock(file, wait=False)


def _lock(file: BinaryIO, *, wait: bool) -> bool:
    """Take a lock that ends with the file or the process; return False if another process holds it."""
    try:
        if sys.platform == "win32":
            file.seek(0)
            msvcrt.locking(file.fileno(), msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)
        else:
            fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if wait:
            raise
        return False
    return True
