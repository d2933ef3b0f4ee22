"""The database's schema, brought to the newest version where it is older.

Alembic does that. It takes as long to import as the rest of the store, so it is left alone where nothing is to be done.
"""

from pathlib import Path

from sqlalchemy import Engine, inspect

NEWEST = "0001"  # revision of the last module in migrations/versions
_MIGRATIONS = Path(__file__).parent / "migrations"
_VERSIONS = "alembic_version"


def bring_up(engine: Engine) -> None:
    """Migrate the database behind `engine`, all or nothing, locked for other writers meanwhile."""
    if _version(engine) == NEWEST:
        return
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_MIGRATIONS).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    with engine.connect().execution_options(vfix_writes=True) as connection, connection.begin():
        config.attributes["connection"] = connection
        command.upgrade(config, "head")


def _version(engine: Engine) -> str | None:
    """The version that the database is at; None when it is new."""
    if not inspect(engine).has_table(_VERSIONS):
        return None
    with engine.connect() as connection:
        version: str | None = connection.exec_driver_sql(f"SELECT version_num FROM {_VERSIONS}").scalar()
    return version
