"""The store: one database of cases and plans, and a folder of content-addressed files.

Files are written without the database's library, which the command line for files does not install.
"""

from typing import TYPE_CHECKING, Any

from app.store.files import FileStore, write_atomically

if TYPE_CHECKING:
    from app.store.database import Store

__all__ = ["FileStore", "Store", "write_atomically"]


def __getattr__(name: str) -> Any:
    if name == "Store":
        from app.store.database import Store

        return Store
    raise AttributeError(f"module {__name__} has no attribute {name!r}")
