"""The embedded database: opened, migrated, and safe to lose power at any moment.

SQLite in WAL mode with synchronous=FULL: a transaction whose commit returned survives a crash (HAZ-24).
"""

import logging
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.orm import Session

from app.settings import Settings
from app.store.errors import DATABASE_ERRORS, StorageError, StoreBusy, StoreUnusable, told
from app.store.files import FileStore
from app.store.private import private_file, private_folder, private_if_there
from app.store.schema import bring_up, is_newest
from app.store.scratch import Scratch
from app.store.snapshot import Snapshot

_LOG = logging.getLogger(__name__)
BUSY_SECONDS = 5.0  # how long a writer waits for another one, of this process or of another of the same home


class Store:
    """Database and files of one home folder; may be used from any thread and by several processes at once.

    scratch: folder for temporary data.
    """

    def __init__(self, settings: Settings) -> None:
        """Raises StorageError, one of its kinds, when the home cannot be used.

        One that cannot be written, or whose disk is full, is read as it is, and every change is refused.
        """
        self._home = settings.home
        self.files, self.scratch = FileStore(settings.files_dir), Scratch(settings.temporary_dir)
        self.run_files = FileStore(settings.runs_dir)  # apart: they are deleted, those of cases never
        self._one_writer = threading.Lock()
        self._snapshot: Snapshot | None = None
        self._refusal: StorageError | None = None
        self._watch: Any = None  # a connection of its own, opened by the first who watches
        try:
            self._engine = self._opened(settings)
        except (StoreUnusable, StoreBusy):
            raise
        except StorageError as error:
            self._engine = self._read_only(settings, error)

    def _opened(self, settings: Settings) -> Engine:
        try:
            private_folder(settings.home)
            _keep_private(settings.database_path)
            engine = _open(settings.database_path)
            bring_up(engine, settings)
            return engine
        except OSError as error:
            raise StorageError(
                f"the data folder {settings.home} cannot be written: {error.strerror or error}; "
                "name another one in VFIX_HOME."
            ) from error
        except DATABASE_ERRORS as error:
            raise told(error, self._home) from error

    def _read_only(self, settings: Settings, refusal: StorageError) -> Engine:
        """The database as it lies there. Raises `refusal` when it cannot be read either."""
        try:
            snapshot = Snapshot(settings.database_path)
            if not is_newest(snapshot.engine):
                raise refusal
        except (OSError, StorageError, *DATABASE_ERRORS):
            raise refusal from None
        _LOG.warning("%s Until then all can be read and nothing be changed.", refusal)
        self._snapshot, self._refusal = snapshot, refusal
        return snapshot.engine

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session that sees one consistent state and writes nothing; no writer makes it wait. Raises StorageError."""
        try:
            with Session(self._engine, expire_on_commit=False) as session:
                yield session
        except DATABASE_ERRORS as error:
            raise told(error, self._home) from error

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A session that is the only writer; committed durably when the block ends, undone when it raises.

        Raises StorageError when the disk refuses the commit, and StoreBusy when another writer does not end.
        """
        if self._refusal is not None:
            raise type(self._refusal)(str(self._refusal))
        # Threads of this process take turns here: those that wait in the database would each hold a connection.
        if not self._one_writer.acquire(timeout=BUSY_SECONDS):
            raise StoreBusy("the database is busy with other changes; try again in a moment.")
        try:
            with Session(self._engine, expire_on_commit=False) as session:
                session.connection(execution_options={"vfix_writes": True})
                yield session
                session.commit()
        except DATABASE_ERRORS as error:
            raise told(error, self._home) from error
        finally:
            self._one_writer.release()

    @property
    def writable(self) -> bool:
        """Whether anything can be changed; a home that takes nothing is only read."""
        return self._refusal is None

    def sweep(self) -> None:
        """Remove the temporary data of planners that ended without doing so, where anything can be changed."""
        if self.writable:
            self.scratch.open()
            self.files.scratch.open()
            self.run_files.scratch.open()
            for left in (self._home / "uploads", *(self._home / "files").glob(".vfix-*")):  # of earlier versions
                shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink(missing_ok=True)

    def data_version(self) -> int:
        """A number that every commit changes, of this process and of others. For one thread, which asks often.

        Raises StorageError when the database cannot be asked.
        """
        try:
            if self._watch is None:
                self._watch = self._engine.raw_connection()
            return int(self._watch.execute("PRAGMA data_version").fetchone()[0])
        except DATABASE_ERRORS as error:
            raise told(error, self._home) from error

    def close(self) -> None:
        """Let go of every connection, and remove what is temporary."""
        if self._watch is not None:
            self._watch.close()
        self._engine.dispose()
        if self._snapshot is not None:
            self._snapshot.close()
        self.scratch.close()
        self.files.scratch.close()
        self.run_files.scratch.close()


def _keep_private(database: Path) -> None:
    """The database and what SQLite keeps beside it; what it makes later has the rights of the database."""
    private_file(database)
    for ending in ("-wal", "-shm"):
        private_if_there(database.with_name(database.name + ending))


def _open(path: Path) -> Engine:
    # Readers must not wait for a connection, and no error may quote a row: names of people may be in it (HAZ-33).
    options = {"max_overflow": -1, "hide_parameters": True}
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": BUSY_SECONDS}, **options)

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
