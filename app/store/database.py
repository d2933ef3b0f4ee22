"""The embedded database: opening, migration, durable transactions.

SQLite in WAL mode with synchronous=FULL: a transaction whose commit returned survives a crash (HAZ-24).
"""

import logging
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.orm import Session

from app.settings import Settings
from app.store.changes import Changes, CountedSession
from app.store.database_errors import DATABASE_ERRORS, storage_error
from app.store.derived import DerivedFiles
from app.store.errors import StorageError, StoreBusy, StoreUnusable
from app.store.files import FileStore
from app.store.private import private_file, private_folder, private_if_there
from app.store.read_only_copy import ReadOnlyCopy
from app.store.schema import bring_up, is_newest
from app.store.scratch import Scratch

_LOG = logging.getLogger(__name__)
BUSY_SECONDS = 5.0  # how long a writer waits for another one, in this or another process with the same data folder


class Store:
    """Database and files of one data folder; thread-safe, and usable by several processes at once.

    scratch: folder for temporary data. drives: the same for the recordings of drives in progress.
    """

    def __init__(self, settings: Settings) -> None:
        """Raises StorageError or a subclass when the data folder cannot be used.

        A folder that is not writable, or whose disk is full, is opened for reading, and changes are refused.
        """
        self._home, self._database = settings.home, settings.database_path
        self.files, self.scratch = FileStore(settings.files_dir), Scratch(settings.temporary_dir)
        self.run_files = FileStore(settings.runs_dir)  # separate, since files of runs are deleted, those of cases not
        self.derived = DerivedFiles(settings.derived_dir, self.files.scratch)
        self.drives = Scratch(settings.drives_dir)
        self._elsewhere: tuple[Scratch, tempfile.TemporaryDirectory[str]] | None = None
        self._one_writer = threading.Lock()
        self._copy: ReadOnlyCopy | None = None
        self._refusal: StorageError | None = None
        self.changes = Changes()
        self._version: int | None = None  # of the database, as the writer's connection counts changes from elsewhere
        self._writer: Engine | None = None
        try:
            self._engine = self._open(settings)
            self._writer = self._one_connection(settings.database_path)
        except (StoreUnusable, StoreBusy):
            raise
        except StorageError as error:
            self._engine = self._read_only(settings, error)

    def _open(self, settings: Settings) -> Engine:
        try:
            private_folder(settings.home)
            _keep_private(settings.database_path)
            engine = _create_engine(settings.database_path)
            try:
                bring_up(engine, settings)
            except BaseException:
                engine.dispose()  # closing the last connection removes SQLite's auxiliary files of a refused database
                raise
            return engine
        except OSError as error:
            raise StorageError(
                f"the data folder {settings.home} cannot be written: {error.strerror or error}; "
                "name another one in VFIX_HOME."
            ) from error
        except DATABASE_ERRORS as error:
            raise storage_error(error, self._home) from error

    def _read_only(self, settings: Settings, refusal: StorageError) -> Engine:
        """Open the database for reading. Raises `refusal` if it cannot be read either."""
        try:
            copy = ReadOnlyCopy(settings.database_path)
            if not is_newest(copy.engine):
                raise refusal
        except (OSError, StorageError, *DATABASE_ERRORS):
            raise refusal from None
        _LOG.warning("%s Until then all can be read and nothing be changed.", refusal)
        self._copy, self._refusal = copy, refusal
        return copy.engine

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Open a read-only session of one consistent state, which does not wait for writers. Raises StorageError."""
        try:
            with Session(self._engine, expire_on_commit=False) as session:
                yield session
        except DATABASE_ERRORS as error:
            raise storage_error(error, self._home) from error

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Open the only writing session; committed durably at the end of the block, rolled back if it raises.

        Raises StorageError if the commit fails, and StoreBusy if another writer does not end in time.
        """
        if self._refusal is not None:
            raise type(self._refusal)(str(self._refusal))
        # Threads of this process wait here, since each thread that waits in the database would hold a connection.
        if not self._one_writer.acquire(timeout=BUSY_SECONDS):
            raise StoreBusy("the database is busy with other changes; try again in a moment.")
        try:
            with CountedSession(self._writer, expire_on_commit=False) as session:
                connection = session.connection(execution_options={"vfix_writes": True})
                self._look(connection.connection.driver_connection)
                yield session
                try:
                    session.commit()
                except BaseException:
                    self.changes.everything()  # it may have come so far
                    raise
                self.changes.committed(session)
        except DATABASE_ERRORS as error:
            raise storage_error(error, self._home) from error
        finally:
            self._one_writer.release()

    @property
    def home(self) -> Path:
        """The data folder."""
        return self._home

    @property
    def writable(self) -> bool:
        """Whether the data folder is writable."""
        return self._refusal is None

    @property
    def exports(self) -> Scratch:
        """Folder for temporary files of exports: that of the system if the data folder is not writable.

        Raises StorageError if that of the system is not writable either.
        """
        if self.writable:
            return self.scratch
        with self._one_writer:
            if self._elsewhere is None:
                try:
                    folder = tempfile.TemporaryDirectory(prefix="vfix-", ignore_cleanup_errors=True)
                except OSError as error:
                    raise StorageError(f"no folder takes temporary files: {error.strerror or error}.") from error
                self._elsewhere = Scratch(Path(folder.name)), folder
            return self._elsewhere[0]

    def sweep(self) -> None:
        """Remove the temporary data of killed planners, if the folder is writable."""
        if self.writable:
            self.scratch.open()
            self.files.scratch.open()
            self.run_files.scratch.open()
            self.drives.open()
            for left in (self._home / "uploads", *(self._home / "files").glob(".vfix-*")):  # of earlier versions
                shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink(missing_ok=True)

    def look(self) -> None:
        """Count what another process has stored. Raises StorageError when the database is not readable."""
        if self._writer is None or not self._one_writer.acquire(blocking=False):
            return  # nothing changes, or whoever writes now looks
        try:
            with closing(self._writer.raw_connection()) as connection:
                self._look(connection.driver_connection)
        except DATABASE_ERRORS as error:
            raise storage_error(error, self._home) from error
        finally:
            self._one_writer.release()

    def _look(self, connection: Any) -> None:
        """connection: the writer's, of which SQLite says that others have stored something, never it itself."""
        version = int(connection.execute("PRAGMA data_version").fetchone()[0])
        before, self._version = self._version, version
        if version != before:
            self.changes.everything()

    def _one_connection(self, path: Path) -> Engine:
        """Of the writer, which is only one."""
        engine = _create_engine(path, pool_size=1, max_overflow=0)

        @event.listens_for(engine, "connect")
        def _on_connect(connection: Any, _: object) -> None:
            self._version = None  # another connection counts anew

        return engine

    def copies(self, holding: str) -> list[Path]:
        """Return copies of the database made before upgrades, complete or not, that contain a text such as an id."""
        found = sorted(self._database.parent.glob(f"{self._database.stem}-*{self._database.suffix}*"))
        return [path for path in found if path.is_file() and holding.encode() in path.read_bytes()]

    def scrub(self) -> None:
        """Rebuild the database without free pages and empty its log, so that neither contains deleted data.

        Raises StoreBusy if another planner keeps using the database, and StorageError.
        """
        if self._refusal is not None:
            raise type(self._refusal)(str(self._refusal))
        try:
            with self._one_writer, closing(self._engine.raw_connection()) as connection:  # outside of a transaction
                connection.cursor().execute("VACUUM")
                busy = connection.cursor().execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]
        except DATABASE_ERRORS as error:
            raise storage_error(error, self._home) from error
        if busy:
            raise StoreBusy("another planner uses the database; end it, and try again.")

    def close(self) -> None:
        """Close all connections and remove temporary data; a drive that was not stored is stored first."""
        self.drives.close()
        if self._writer is not None:
            self._writer.dispose()
        self._engine.dispose()
        if self._copy is not None:
            self._copy.close()
        if self._elsewhere is not None:
            self._elsewhere[0].close()
            self._elsewhere[1].cleanup()
        self.scratch.close()
        self.files.scratch.close()
        self.run_files.scratch.close()


def _keep_private(database: Path) -> None:
    """Restrict the permissions of the database and of SQLite's files; later files inherit those of the database."""
    private_file(database)
    for ending in ("-wal", "-shm"):
        private_if_there(database.with_name(database.name + ending))


def _create_engine(path: Path, pool_size: int = 5, max_overflow: int = -1) -> Engine:
    # Readers must not wait for a connection, and no error may quote a row: names of people may be in it (HAZ-33).
    options = {"pool_size": pool_size, "max_overflow": max_overflow, "hide_parameters": True}
    engine = create_engine(f"sqlite:///{path}", connect_args={"timeout": BUSY_SECONDS}, **options)

    @event.listens_for(engine, "connect")
    def _on_connect(connection: Any, _: object) -> None:
        connection.isolation_level = None  # the driver must not begin transactions of its own
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _on_begin(connection: Connection) -> None:
        # A writer locks from the start: a lock taken at its first write would fail if data that it read has changed.
        writes = connection.get_execution_options().get("vfix_writes", False)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine
