"""Check whether the store of a data folder can be opened, without changing it."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from sqlalchemy import StaticPool, create_engine

from app.settings import Settings
from app.store.database_errors import DATABASE_ERRORS, storage_error
from app.store.errors import COPY, StorageError, StoreDamaged
from app.store.schema import check_version

_BUSY_S = 5.0


def check_store(settings: Settings) -> None:
    """Raise the StorageError that opening the store would raise; an older or missing database is accepted."""
    with closing(sqlite3.connect(":memory:")) as kept:
        try:
            if settings.database_path.exists():
                _copy_into(kept, settings.database_path)
                if kept.execute("PRAGMA quick_check(1)").fetchone()[0] != "ok":
                    raise StoreDamaged(f"the database is damaged; {COPY}.")
            engine = create_engine("sqlite://", creator=lambda: kept, poolclass=StaticPool, hide_parameters=True)
            with engine.connect() as connection:
                check_version(connection, settings)
        except OSError as error:
            raise StorageError(f"the data folder {settings.home} cannot be read: {error.strerror or error}.") from error
        except DATABASE_ERRORS as error:
            raise storage_error(error, settings.home) from error


def _copy_into(kept: sqlite3.Connection, database: Path) -> None:
    """Copy the current database, which another planner may have open."""
    log = database.with_name(database.name + "-wal")
    # If opened for writing, SQLite removes its auxiliary files again; if it cannot write, it must not look for them.
    for options in ("mode=rw", "mode=ro&immutable=1"):
        try:
            with closing(sqlite3.connect(f"{database.as_uri()}?{options}", uri=True, timeout=_BUSY_S)) as source:
                source.execute("BEGIN")
                source.execute("SELECT count(*) FROM sqlite_master").fetchone()  # backup itself has no timeout
                source.backup(kept)
            return
        except sqlite3.OperationalError as error:
            refused = str(getattr(error, "sqlite_errorname", "")).startswith(("SQLITE_CANTOPEN", "SQLITE_READONLY"))
            if not refused or "immutable" in options or (log.exists() and log.stat().st_size):
                raise
