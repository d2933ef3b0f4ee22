"""The store: one database of cases and plans, and a folder of content-addressed files."""

from app.store.database import Store
from app.store.files import FileStore, write_atomically

__all__ = ["FileStore", "Store", "write_atomically"]
