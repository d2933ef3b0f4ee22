"""The embedded database: opened, migrated, and safe to lose power at any moment.

SQLite in WAL mode with synchronous=FULL: a transaction whose commit returned survives a crash (HAZ-24).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from app.settings import Settings
from app.store.files import FileStore, StorageError
from app.store.private import private_file, private_folder, private_if_there
from app.store.schema import bring_up

_BUSY_SECONDS = 30  # how long a writer waits for another process of the same home


class Store:
    """Database and files of one home folder; may be used from any thread and by several processes at once."""

    def __init__(self, settings: Settings) -> None:
        private_folder(settings.home)
        _keep_private(settings.database_path)
        self.files = FileStore(settings.files_dir)
        self._engine = _open(settings.database_path)
        bring_up(self._engine)
        self._watch: Any = None  # a connection of its own, opened by the first who watches

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session that sees one consistent state and writes nothing."""
        with Session(self._engine, expire_on_commit=False) as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A session that is the only writer; committed durably when the block ends, undone when it raises.

        Raises StorageError when the disk refuses the commit.
        """
        try:
            with Session(self._engine, expire_on_commit=False) as session:
                session.connection(execution_options={"vfix_writes": True})
                yield session
                session.commit()
        except OperationalError as error:
            raise StorageError(f"the change could not be stored: {error.orig}.") from error

    def data_version(self) -> int:
        """A number that every commit changes, of this process and of others. For one thread, which asks often."""
        if self._watch is None:
            self._watch = self._engine.raw_connection()
        return int(self._watch.execute("PRAGMA data_version").fetchone()[0])

    def close(self) -> None:
        """Let go of every connection."""
        if self._watch is not None:
            self._watch.close()
        self._engine.dispose()


def utc_now() -> str:
    """The time now, ISO 8601 in UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _keep_private(database: Path) -> None:
    """The database and what SQLite keeps beside it; what it makes later has the rights of the database."""
    private_file(database)
    for ending in ("-wal", "-shm"):
        private_if_there(database.with_name(database.name + ending))


def _open(path: Path) -> Engine:
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": _BUSY_SECONDS})

    @event.listens_for(engine, "connect")
    def _on_connect(connection: Any, _: object) -> None:
        connection.isolation_level = None  # the driver must not begin transactions of its own
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _on_begin(connection: Connection) -> None:
        # A writer locks at once: a lock taken only at its first write would fail on what it read before.
        writes = connection.get_execution_options().get("vfix_writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine
