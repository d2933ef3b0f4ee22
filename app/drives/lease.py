"""The lease of the handle: one client holds it, the others watch (HAZ-12)."""

from __future__ import annotations

import threading

from app.messages.client import Client


class Lease:
    """At most one holder, which releases the handle itself, or when its client is gone. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._holder: Client | None = None

    @property
    def holder(self) -> Client | None:
        with self._lock:
            return self._holder

    def take(self, client: Client) -> bool:
        """Become the holder; False while another client is, and for a client whose role does not hold."""
        with self._lock:
            if not client.may_hold or (self._holder is not None and self._holder.id != client.id):
                return False
            self._holder = client
            return True

    def let_go(self, client: Client) -> bool:
        """Stop being the holder; False when this client was not."""
        with self._lock:
            if self._holder is None or self._holder.id != client.id:
                return False
            self._holder = None
            return True

    def held_by(self, client: Client) -> bool:
        with self._lock:
            return self._holder is not None and self._holder.id == client.id
