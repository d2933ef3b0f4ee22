"""Errors of the database as errors of the store, and which of them mean what."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from app.store.errors import COPY, StorageError, StoreBusy, StoreDamaged

_ROOM = 1 << 20  # [byte] without which SQLite cannot even open a database

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
