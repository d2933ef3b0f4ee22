"""Migration of the database's schema to the newest version.

Alembic is imported only when there is something to migrate, since its import takes as long as the rest of the store.
"""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, inspect

from app.settings import Settings
from app.store.errors import COPY, StorageError, StoreUnusable
from app.store.private import private_file

if TYPE_CHECKING:
    from alembic.config import Config

NEWEST = "0002"  # revision of the last module in migrations/versions
_MIGRATIONS = Path(__file__).parent / "migrations"
_VERSIONS = "alembic_version"
KEPT_COPIES = 3  # copies of the database made before upgrades


def bring_up(engine: Engine, settings: Settings) -> None:
    """Migrate the database of `engine` in one transaction, locked for other writers.

    An older database is copied first; the newest copies are kept.
    Raises StoreUnusable for a newer database, one of another program, and an empty one if files of cases exist.
    """
    if is_newest(engine):
        return
    with engine.connect().execution_options(vfix_writes=True) as connection, connection.begin():
        found = _version(connection)  # again, since another planner may have migrated it meanwhile
        if found is None:
            _check_new(connection, settings)
        elif found == NEWEST:
            return
        _migrate(connection, found, settings.database_path)
    _drop_old_copies(settings)  # only now that the upgrade is durable


def is_newest(engine: Engine) -> bool:
    """Return whether the schema is the newest."""
    return _version(engine) == NEWEST


def check_version(connection: Connection, settings: Settings) -> None:
    """Raise StoreUnusable if `bring_up` would."""
    found = _version(connection)
    if found is None:
        _check_new(connection, settings)
    elif found != NEWEST:
        _check_known(found, _config())


def _migrate(connection: Connection, found: str | None, database: Path) -> None:
    from alembic import command

    config = _config()
    if found is not None:
        _check_known(found, config)
        _copy(database, database.with_name(f"{database.stem}-{found}{database.suffix}"))
    config.attributes["connection"] = connection
    command.upgrade(config, "head")


def _config() -> Config:
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def _check_known(found: str, config: Config) -> None:
    from alembic.script import ScriptDirectory

    known = {script.revision for script in ScriptDirectory.from_config(config).walk_revisions()}
    if found not in known:
        raise StoreUnusable(
            f"the database is of version {found:.20} and was made by a newer vfix; this one knows up to {NEWEST}. "
            "Install the newer vfix, or name another data folder in VFIX_HOME."
        )


def _version(engine: Engine | Connection) -> str | None:
    """Return the version of the database; None if it is new."""
    if not inspect(engine).has_table(_VERSIONS):
        return None
    if isinstance(engine, Engine):
        with engine.connect() as connection:
            return _version(connection)
    found: str | None = engine.exec_driver_sql(f"SELECT version_num FROM {_VERSIONS}").scalar()
    return found


def _check_new(connection: Connection, settings: Settings) -> None:
    """Raise StoreUnusable for a database without a version if initialising it could lose data."""
    tables = inspect(connection).get_table_names()
    if set(tables) - {_VERSIONS}:
        raise StoreUnusable(f"the database was not made by vfix: it holds {', '.join(tables[:5])}; {COPY}.")
    files = sum(1 for file in settings.files_dir.glob("??/*") if len(file.name) == 64)
    if files:
        raise StoreUnusable(
            f"the database is empty, but there are {files} files of cases in {settings.files_dir}: it was lost. "
            f"Put back {settings.database_path.name} from a copy, or move that folder away to begin anew."
        )


def _drop_old_copies(settings: Settings) -> None:
    """Delete all but the newest copies; one that cannot be deleted stays."""
    for copy in settings.database_copies[:-KEPT_COPIES]:
        with suppress(OSError):
            copy.unlink()


def _copy(database: Path, copy: Path) -> None:
    """Copy the database atomically."""
    half = copy.with_name(copy.name + ".half")
    try:
        private_file(half)
        with closing(sqlite3.connect(database)) as source, closing(sqlite3.connect(half)) as target:
            source.backup(target)
        os.replace(half, copy)
    except (OSError, sqlite3.Error) as error:
        with suppress(OSError):
            half.unlink()
        raise StorageError(
            f"the database has to be brought up to date, but no copy of it could be made before: {error}."
        ) from error
