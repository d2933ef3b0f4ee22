"""Errors of the store.

StorageError            the disk is full, read-only or defective
├── StoreBusy           another program locks the database; try again
└── StoreUnusable       the data folder has no store that this version can use
    └── StoreDamaged    a part of it is not readable
"""

from __future__ import annotations

from vfix_engine.errors import VfixError

COPY = "restore a copy of the data folder, or name another in VFIX_HOME"


class StorageError(VfixError):
    """The disk is full, read-only or defective."""


class StoreBusy(StorageError):
    """Another program locks the database."""


class StoreUnusable(StorageError):
    """The data folder has no store that this version can use."""


class StoreDamaged(StoreUnusable):
    """A part of the store is not readable."""
