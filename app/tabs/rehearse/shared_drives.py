"""The shared drives of the planner, by plan."""

from __future__ import annotations

import threading

from app.messages.client import Client
from app.tabs.rehearse.poses import MAX_READERS
from app.tabs.rehearse.shared_drive import SharedDrive


class SharedDrives:
    """Drives by plan; a drive that nobody watches any more is closed and forgotten."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.readers = threading.BoundedSemaphore(MAX_READERS)  # of poses, at a time
        self._drives: dict[str, SharedDrive] = {}

    def enter(self, plan_id: str, client: Client) -> SharedDrive:
        """The drive of a plan, with this client as one of its watchers."""
        with self._lock:
            drive = self._drives.get(plan_id)
            if drive is None:
                drive = self._drives[plan_id] = SharedDrive()
            drive.watchers.add(client.id)
            return drive

    def find(self, plan_id: str) -> SharedDrive | None:
        """The drive of a plan, for somebody who only reads; None where nobody is in it."""
        with self._lock:
            return self._drives.get(plan_id)

    def leave(self, drive: SharedDrive, client: Client) -> None:
        """A client goes; the robot that nobody watches any more is sent home."""
        with self._lock:
            drive.watchers.discard(client.id)
            if drive.watchers:
                return
            # Whoever enters from here on gets another one: this one closes after the lock is free.
            self._drives = {plan_id: other for plan_id, other in self._drives.items() if other is not drive}
        drive.close()

    def close(self) -> None:
        with self._lock:
            drives = list(self._drives.values())
            self._drives.clear()
        for drive in drives:
            drive.close()
