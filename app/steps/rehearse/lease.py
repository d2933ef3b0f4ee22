"""Who holds the handle: one client at a time, the others watch (HAZ-12)."""

from __future__ import annotations

import threading


class Lease:
    """At most one holder. A holder lets go by itself, or is released when its page is gone."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._holder: str | None = None

    @property
    def holder(self) -> str | None:
        with self._lock:
            return self._holder

    def take(self, client: str) -> bool:
        """Become the holder; False while somebody else is."""
        with self._lock:
            if self._holder not in (None, client):
                return False
            self._holder = client
            return True

    def let_go(self, client: str) -> bool:
        """Stop being the holder; False when this client was not."""
        with self._lock:
            if self._holder != client:
                return False
            self._holder = None
            return True

    def held_by(self, client: str) -> bool:
        with self._lock:
            return self._holder == client
