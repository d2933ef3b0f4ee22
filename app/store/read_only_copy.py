"""Read access to a database in a folder that is not writable, through a copy in memory."""

from __future__ import annotations

import secrets
import sqlite3
from contextlib import closing
from pathlib import Path

from sqlalchemy import Engine, create_engine, event
from sqlalchemy.pool import QueuePool

from app.store.errors import StorageError


class ReadOnlyCopy:
    """A copy of the database at the time of creation; `engine` reads it until `close`.

    SQLite cannot open it directly, since a database with a write-ahead log requires auxiliary files in its folder.
    """

    def __init__(self, database: Path) -> None:
        """Copy the database. Raises StorageError if the newest edits are only in the log, which needs write access."""
        log = database.with_name(database.name + "-wal")
        if log.exists() and log.stat().st_size:
            raise StorageError("its newest edits can only be read where it can be written.")
        name = f"file:vfix-{secrets.token_hex(8)}?mode=memory&cache=shared"
        # Kept open, since a database in memory ends with its last connection.
        self._kept = sqlite3.connect(name, uri=True, check_same_thread=False)
        with closing(sqlite3.connect(f"{database.as_uri()}?mode=ro&immutable=1", uri=True)) as source:
            source.backup(self._kept)
        self.engine = _engine(name)

    def close(self) -> None:
        """Close the copy."""
        self.engine.dispose()
        self._kept.close()


def _engine(name: str) -> Engine:
    engine = create_engine(
        "sqlite://",
        creator=lambda: sqlite3.connect(name, uri=True, check_same_thread=False),
        poolclass=QueuePool,
        max_overflow=-1,
        hide_parameters=True,
    )

    @event.listens_for(engine, "connect")
    def _on_connect(connection: sqlite3.Connection, _: object) -> None:
        connection.execute("PRAGMA query_only=ON")

    return engine
