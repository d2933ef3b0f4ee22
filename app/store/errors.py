"""Why the store cannot do what it is asked.

StorageError            the disk refuses: full, read-only or broken
├── StoreBusy           another program holds the database; to be tried again
└── StoreUnusable       what is in the home folder is not a store that this vfix can use
    └── StoreDamaged    a part of it cannot be read any more
"""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from vfix_engine.errors import VfixError

_ROOM = 1 << 20  # [byte] without which SQLite cannot even open a database
COPY = "put back a copy of the data folder, or name another one in VFIX_HOME"


class StorageError(VfixError):
    """The disk refused: full, read-only or broken."""


class StoreBusy(StorageError):
    """Another program holds the database."""


class StoreUnusable(StorageError):
    """The home folder holds something that this vfix cannot use as its store."""


class StoreDamaged(StoreUnusable):
    """A part of the store cannot be read any more."""


DATABASE_ERRORS = (DBAPIError, sqlite3.Error)  # the second where a connection is opened


def is_of_reading(error: DBAPIError) -> bool:
    """Whether the database gave something and its text cannot be read: one row is damaged then, not all of them."""
    return not hasattr(error.orig, "sqlite_errorname")


def told(error: DBAPIError | sqlite3.Error, home: Path) -> StorageError:
    """The error of the database of a home in words of ours, which hold no value of a row."""
    cause = error.orig if isinstance(error, DBAPIError) else error
    name = str(getattr(cause, "sqlite_errorname", ""))
    if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
        return StoreBusy("another program holds the database; try again when it is done.")
    if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")):
        return StoreDamaged(f"the database is damaged; {COPY}.")
    if name == "SQLITE_FULL" or (name.startswith("SQLITE_IOERR") and shutil.disk_usage(home).free < _ROOM):
        return StorageError("the disk is full: nothing can be stored before there is room.")
    if name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN", "SQLITE_PERM")):
        return StorageError("the data folder cannot be written: check its rights, or name another one in VFIX_HOME.")
    if name.startswith("SQLITE_IOERR"):
        return StorageError("the disk does not read or write the database as it should.")
    if not name:  # not the database's own error, but that of reading what it gave
        return StoreDamaged("what the database holds cannot be read.")
    return StorageError(f"the database refused ({name}).")
