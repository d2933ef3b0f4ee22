"""Admission queue for heavy work: few run at a time, some wait in order, and further ones are refused."""

from __future__ import annotations

import threading
from itertools import count

from app.kit.errors import TooMany


class AdmissionQueue:
    """Admission of one kind of work. Thread-safe.

    what: the work in plural, for messages. at_once: how many run at a time. most: how many are admitted in total,
    waiting, running, or finished but still holding a resource, such as a file that is being sent.
    """

    def __init__(self, what: str, at_once: int, most: int) -> None:
        self._what, self._at_once, self._most = what, at_once, most
        self._lock, self._numbers = threading.Lock(), count()
        self._working: dict[int, bool] = {}  # by ticket, in order: True while it waits or runs

    def join(self) -> int:
        """Return a ticket for the end of the queue. Raises TooMany if the queue is full."""
        with self._lock:
            if len(self._working) >= self._most:
                raise TooMany(f"{self._most} {self._what} are under way already; try again when one of them has ended.")
            ticket = next(self._numbers)
            self._working[ticket] = True
            return ticket

    def is_turn(self, ticket: int) -> bool:
        """Return whether the holder of a ticket may run."""
        with self._lock:
            return ticket in [one for one, working in self._working.items() if working][: self._at_once]

    def done(self, ticket: int) -> None:
        """Mark the work as finished; its place stays taken until `leave`."""
        with self._lock:
            self._working[ticket] = False

    def leave(self, ticket: int) -> None:
        """Free the place of a ticket."""
        with self._lock:
            self._working.pop(ticket, None)
