"""The queue of a session's thread: requests in order, with latest-wins slots for streams."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

Request = Callable[[], None]
MAX_WAITING = 512  # queued requests of one client, beyond which its messages are refused


class Inbox:
    """Thread-safe. A request with a slot replaces an unanswered one of the same slot, at its position."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._queue: queue.Queue[str | Request | None] = queue.Queue()
        self._slots: dict[str, Request] = {}

    def put(self, request: Request, slot: str | None = None) -> None:
        """Queue a request of the planner itself, which is never refused: a flood must not prevent a release."""
        with self._lock:
            self._put(request, slot)

    def offer(self, request: Request, slot: str | None = None) -> bool:
        """Queue a request of the page or its scene; False when too many wait already."""
        with self._lock:
            if slot not in self._slots and self._queue.qsize() >= MAX_WAITING:
                return False
            self._put(request, slot)
            return True

    def _put(self, request: Request, slot: str | None) -> None:
        if slot is None:
            self._queue.put(request)
            return
        if slot not in self._slots:
            self._queue.put(slot)
        self._slots[slot] = request

    def close(self) -> None:
        """The last thing a reader gets is None."""
        self._queue.put(None)

    def get(self, timeout: float | None = None) -> Request | None:
        """The next request; None at the end. Raises ``queue.Empty`` after ``timeout`` seconds, where it is given."""
        entry = self._queue.get(timeout=timeout)
        if isinstance(entry, str):
            with self._lock:
                return self._slots.pop(entry)
        return entry
