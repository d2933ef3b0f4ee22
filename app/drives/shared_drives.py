"""The shared drives of one tab's clients, by case and document."""

from __future__ import annotations

import threading
from typing import Any, Generic, NamedTuple, TypeVar

from app.drives.poses import MAX_READERS
from app.drives.prepared_drive import PreparedDrive
from app.drives.shared_drive import SharedDrive
from app.messages.client import Client
from vfix_engine.runtime.snapshot import Snapshot

P = TypeVar("P", bound=PreparedDrive[Any])
T = TypeVar("T", bound=Snapshot)


class DriveKey(NamedTuple):
    """The subject of a drive: a document of a case, such as a plan, or the case itself."""

    case_id: str
    document_id: str | None = None


class SharedDrives(Generic[P, T]):
    """Drives by their subject; a drive without clients is closed and removed. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.readers = threading.BoundedSemaphore(MAX_READERS)  # of poses, at a time
        self._drives: dict[DriveKey, SharedDrive[P, T]] = {}

    def enter(self, key: DriveKey, client: Client) -> SharedDrive[P, T]:
        """The drive of a document or case, with this client as one of its watchers."""
        with self._lock:
            drive = self._drives.get(key)
            if drive is None:
                drive = self._drives[key] = SharedDrive()
            drive.watchers.add(client.id)
            return drive

    def find(self, case_id: str | None, document_id: str | None) -> SharedDrive[P, T] | None:
        """The drive of a document, or of a case itself, for a reader; None where no client is in it."""
        with self._lock:
            for key, drive in self._drives.items():
                if key.document_id == document_id and case_id in (None, key.case_id):
                    return drive
            return None

    def has(self, drive: SharedDrive[P, T]) -> bool:
        """Whether a client is in this drive."""
        with self._lock:
            return any(known is drive for known in self._drives.values())

    def leave(self, drive: SharedDrive[P, T], client: Client) -> None:
        """A client leaves; a drive without clients is ended."""
        with self._lock:
            drive.watchers.discard(client.id)
            if drive.watchers:
                return
            # A client that enters from here on gets another drive: this one closes after the lock is free.
            self._drives = {key: other for key, other in self._drives.items() if other is not drive}
        drive.close()

    def close(self) -> None:
        with self._lock:
            drives = list(self._drives.values())
            self._drives.clear()
        for drive in drives:
            drive.close()
