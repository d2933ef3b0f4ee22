"""Errors of the store.

StorageError            the disk is full, read-only or defective
├── StoreBusy           another program locks the database; try again
└── StoreUnusable       the data folder has no store that this version can use
    └── StoreDamaged    a part of it is not readable
"""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from vfix_engine.errors import VfixError

_ROOM = 1 << 20  # [byte] without which SQLite cannot even open a database
COPY = "restore a copy of the data folder, or name another in VFIX_HOME"


class StorageError(VfixError):
    """The disk is full, read-only or defective."""


class StoreBusy(StorageError):
    """Another program locks the database."""


class StoreUnusable(StorageError):
    """The data folder has no store that this version can use."""


class StoreDamaged(StoreUnusable):
    """A part of the store is not readable."""


DATABASE_ERRORS = (DBAPIError, sqlite3.Error)  # the second is raised when a connection is opened


def is_of_reading(error: DBAPIError) -> bool:
    """Return whether an error is due to an unreadable value, so that one row is damaged, not the database."""
    return not hasattr(error.orig, "sqlite_errorname")


def storage_error(error: DBAPIError | sqlite3.Error, home: Path) -> StorageError:
    """Convert an error of the database to a StorageError whose message contains no values of rows."""
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
    if not name:  # not an error of SQLite, but of decoding a value
        return StoreDamaged("what the database holds cannot be read.")
    return StorageError(f"the database refused ({name}).")
